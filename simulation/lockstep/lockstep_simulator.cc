// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/lockstep/lockstep_simulator.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <type_traits>
#include <utility>

#include "compile_scene.h"
#include "lane_batch.h"
#include "prescene/core/check.h"
#include "prescene/simulation/own_actions.h"
#include "prescene/simulation/rules/mechanics_hash.h"

namespace prescene::simulation {
namespace {

constexpr std::uint32_t kSnapshotVersion = 0x4c4b0006;

core::Status wrong_snapshot() {
  return core::invalid_input(
      "the snapshot is of another simulator, scene or list of actions; restore it where it was saved");
}

class LockstepInstance : public Instance {
 public:
  LockstepInstance(std::shared_ptr<const CompiledLockstep> scene, std::vector<belief::Action> actions,
                   const core::RandomStream& stream)
      : scene_(std::move(scene)),
        actions_(std::move(actions)),
        stream_(stream),
        actions_hash_(mechanics_hash(actions_, stream_)),
        engine_(scene_, 1),
        instance_(*scene_),
        nudges_(scene_->lanes.objects) {
    set_state(belief::mean_start(scene_->scene));
  }

  void set_state(const belief::WorldState& state) override {
    PRESCENE_CHECK(state.objects.size() == scene_->scene.objects.size());
    start_ = state;
    tested_ = false;
    instance_.start(engine_, 0, start_, actions_, stream_);
  }

  belief::WorldState state() const override {
    belief::WorldState state;
    instance_.read(engine_, 0, state);
    return state;
  }

  void step() override {
    instance_.before_step(engine_, 0);
    engine_.find_contacts(one_);
    engine_.advance(one_);
    instance_.after_step(engine_, 0);
    if (!instance_.calm(engine_, 0)) tested_ = false;
  }

  double step_size() const override { return scene_->options.step; }

  bool at_rest() const override {
    if (!instance_.calm(engine_, 0)) return false;
    if (!tested_) {
      instance_.before_step(engine_, 0);
      engine_.find_contacts(one_);
      if (nudges_.slides(engine_, 0)) return false;
      tested_ = true;
      stable_ = balances();
    }
    return stable_;
  }

  Snapshot save() const override {
    Snapshot snapshot;
    ByteWriter out(snapshot.bytes);
    out.value(kSnapshotVersion);
    out.value(scene_->hash);
    out.value(actions_hash_);
    out.value(static_cast<std::uint32_t>(start_.objects.size()));
    out.value(start_.time);
    for (const belief::ObjectState& object : start_.objects) {
      out.value(object.physical.mass);
      out.vector(object.physical.center_of_mass);
      out.value(object.physical.friction);
      out.value(object.physical.impact_friction);
      out.value(object.physical.restitution);
    }
    SlotState slot;
    engine_.save(0, slot);
    for (const ObjectSlot& object : slot) write(out, object);
    instance_.save(out);
    return snapshot;
  }

  core::Status restore(const Snapshot& snapshot) override {
    ByteReader in(snapshot.bytes);
    if (in.value<std::uint32_t>() != kSnapshotVersion) return wrong_snapshot();
    if (in.value<std::uint64_t>() != scene_->hash) return wrong_snapshot();
    if (in.value<std::uint64_t>() != actions_hash_) return wrong_snapshot();
    if (in.value<std::uint32_t>() != start_.objects.size()) return wrong_snapshot();
    belief::WorldState start = start_;
    start.time = in.value<double>();
    for (belief::ObjectState& object : start.objects) {
      object.physical.mass = in.value<double>();
      object.physical.center_of_mass = in.vector();
      object.physical.friction = in.value<double>();
      object.physical.impact_friction = in.value<double>();
      object.physical.restitution = in.value<double>();
    }
    SlotState slot(start.objects.size());
    bool sound = true;
    const auto parts = static_cast<std::int32_t>(scene_->lanes.parts.size());
    for (ObjectSlot& object : slot) sound = sound && read(in, parts, scene_->lanes.room(), object);
    // A single object never falls asleep.
    sound = sound && (slot.size() > 1 || slot.empty() || slot.front().motion != LaneMotion::kAsleep);
    if (!sound || !in.ok()) return wrong_snapshot();
    const Snapshot now = save();
    std::swap(start_, start);
    instance_.start(engine_, 0, start_, actions_, stream_);
    instance_.restore(in);
    tested_ = false;
    if (!in.ok() || !in.at_end()) {
      PRESCENE_CHECK(restore(now).ok());
      return wrong_snapshot();
    }
    engine_.restore(0, slot);
    return core::ok_status();
  }

 private:
  static void write(ByteWriter& out, const ObjectSlot& object) {
    const auto all = [&](const auto& values) {
      for (const auto& value : values) out.value(value);
    };
    all(object.p);
    all(object.v);
    all(object.w);
    all(object.q);
    all(object.middle_v);
    all(object.middle_w);
    out.value(object.lag);
    out.value(object.owed);
    out.value(object.motion);
    out.value(object.parting);
    out.value(object.warm_count);
    for (int i = 0; i < object.warm_count; ++i) {
      all(object.warm[i].position);
      out.value(object.warm[i].impulse);
      all(object.warm[i].friction);
      out.value(object.warm[i].upward);
      out.value(object.warm[i].part);
    }
    out.value(object.footing_count);
    for (int i = 0; i < object.footing_count; ++i) {
      all(object.footing[i].position);
      all(object.footing[i].normal);
      out.value(object.footing[i].gap);
      out.value(object.footing[i].part);
      out.value(object.footing[i].impulse);
      out.value(object.footing[i].hit);
    }
  }

  static bool read(ByteReader& in, std::int32_t parts, int room, ObjectSlot& object) {
    const auto all = [&](auto& values) {
      for (auto& value : values) value = in.value<std::decay_t<decltype(value)>>();
    };
    all(object.p);
    all(object.v);
    all(object.w);
    all(object.q);
    all(object.middle_v);
    all(object.middle_w);
    object.lag = in.value<Real>();
    object.owed = in.value<Real>();
    object.motion = in.value<LaneMotion>();
    object.parting = in.value<std::uint64_t>();
    object.warm_count = in.value<int>();
    if (object.motion > LaneMotion::kAsleep || object.warm_count < 0 || object.warm_count > room) return false;
    for (int i = 0; i < object.warm_count; ++i) {
      all(object.warm[i].position);
      object.warm[i].impulse = in.value<Real>();
      all(object.warm[i].friction);
      object.warm[i].upward = in.value<Real>();
      object.warm[i].part = in.value<std::int32_t>();
      if (object.warm[i].part < 0 || object.warm[i].part >= parts) return false;
    }
    object.footing_count = in.value<int>();
    if (object.footing_count < 0 || object.footing_count > kMostFooting) return false;
    for (int i = 0; i < object.footing_count; ++i) {
      LaneContact& c = object.footing[i];
      c = LaneContact{};
      all(c.position);
      all(c.normal);
      c.gap = in.value<Real>();
      c.part = in.value<std::int32_t>();
      c.impulse = in.value<Real>();
      c.hit = in.value<std::int32_t>();
      if (c.part < 0 || c.part >= parts) return false;
    }
    return true;
  }

  /// After contacts have been found. Moves objects and puts them back.
  bool balances() const {
    if (nudges_.stands_or_begins(engine_, 0)) return true;
    for (;;) {
      engine_.find_contacts(one_);
      engine_.advance(one_);
      const NudgeTest::Verdict verdict = nudges_.after_step(engine_, 0);
      if (verdict != NudgeTest::Verdict::kGoesOn) return verdict == NudgeTest::Verdict::kReturns;
    }
  }

  std::shared_ptr<const CompiledLockstep> scene_;
  std::vector<belief::Action> actions_;
  core::RandomStream stream_;
  std::uint64_t actions_hash_;
  belief::WorldState start_;
  // Asking whether it rests nudges objects and puts them back, which leaves all as it was.
  mutable LaneEngine engine_;
  mutable LaneInstance instance_;
  mutable NudgeTest nudges_;
  mutable bool tested_ = false;
  mutable bool stable_ = false;
  std::vector<std::uint8_t> one_ = {1};
};

class LockstepSimulator : public Simulator, public OwnActionsRunner {
 public:
  explicit LockstepSimulator(std::shared_ptr<const CompiledLockstep> scene) : scene_(std::move(scene)) {}

  core::Status supports(const RunRequest& request) const override { return check_actions(request.actions); }
  StepperUse stepper() const override { return {"lockstep", "", scene_->hull_error}; }

  void run(std::span<const belief::WorldState> starts, const RunRequest& request, const core::RandomStream& stream,
           InstanceNumbers numbers, core::ThreadPool& pool, std::span<belief::Trajectory> trajectories,
           const core::Cancellation* cancellation) const override {
    PRESCENE_CHECK(starts.size() == trajectories.size());
    PRESCENE_CHECK(supports(request).ok());
    if (starts.empty()) return;
    LaneQueue queue;
    queue.starts = starts;
    queue.request = &request;
    queue.trajectories = trajectories;
    queue.stream = &stream;
    queue.numbers = numbers;
    queue.cancellation = cancellation;
    run(queue, starts.size(), scene_for(request.actions), pool);
  }

  void run_own(std::span<const belief::WorldState> starts, std::span<const std::vector<belief::Action>> actions,
               const RunRequest& request, const core::RandomStream& stream, InstanceNumbers numbers,
               core::ThreadPool& pool, std::span<belief::Trajectory> trajectories,
               const core::Cancellation* cancellation) const override {
    // Those with the same balls are of one scene.
    std::map<std::vector<double>, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < starts.size(); ++i) {
      PRESCENE_CHECK(check_actions(actions[i]).ok());
      groups[pusher_radii(actions[i])].push_back(i);
    }
    for (const auto& [radii, members] : groups) {
      LaneQueue queue;
      queue.starts = starts;
      queue.request = &request;
      queue.actions = actions;
      queue.members = members;
      queue.trajectories = trajectories;
      queue.stream = &stream;
      queue.numbers = numbers;
      queue.cancellation = cancellation;
      run(queue, members.size(), scene_for(actions[members.front()]), pool);
    }
  }

  double step_size() const override { return scene_->options.step; }
  std::unique_ptr<Instance> make_instance(const std::vector<belief::Action>& actions,
                                          const core::RandomStream& stream) const override {
    PRESCENE_CHECK(check_actions(actions).ok());
    return std::make_unique<LockstepInstance>(scene_for(actions), actions, stream);
  }

 private:
  void run(LaneQueue& queue, std::size_t count, const std::shared_ptr<const CompiledLockstep>& scene,
           core::ThreadPool& pool) const {
    // Each thread gets its share of the instances at once, so that none waits for another's.
    const auto threads = std::min(static_cast<std::size_t>(pool.threads()), count);
    const auto share = static_cast<int>((count + threads - 1) / threads);
    pool.for_each_index(threads, [&](std::size_t) {
      std::unique_ptr<LaneBatch> batch = take_batch(scene);
      batch->run(queue, std::min(share, scene->options.live_instances));
      give_back(std::move(batch));
    });
  }

  /// The scene with the balls of these actions; the last one asked for is kept.
  std::shared_ptr<const CompiledLockstep> scene_for(const std::vector<belief::Action>& actions) const {
    const std::vector<double> radii = pusher_radii(actions);
    if (radii.empty()) return scene_;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!pushed_ || pushed_->pushers != radii) {
      pushed_ = with_pushers(*scene_, radii);
      idle_.clear();
    }
    return pushed_;
  }
  std::unique_ptr<LaneBatch> take_batch(const std::shared_ptr<const CompiledLockstep>& scene) const {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto fits = [&](const std::unique_ptr<LaneBatch>& batch) { return batch->scene() == scene; };
      const auto found = std::find_if(idle_.begin(), idle_.end(), fits);
      if (found != idle_.end()) {
        std::unique_ptr<LaneBatch> batch = std::move(*found);
        idle_.erase(found);
        return batch;
      }
    }
    return std::make_unique<LaneBatch>(scene);
  }
  void give_back(std::unique_ptr<LaneBatch> batch) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (batch->scene() == scene_ || batch->scene() == pushed_) idle_.push_back(std::move(batch));
  }

  std::shared_ptr<const CompiledLockstep> scene_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const CompiledLockstep> pushed_;
  mutable std::vector<std::unique_ptr<LaneBatch>> idle_;
};

}  // namespace

core::Result<std::unique_ptr<Simulator>> make_lockstep_simulator(const belief::Scene& scene, ShapeStore& shapes,
                                                                 const LockstepOptions& options) {
  PRESCENE_TRY(auto compiled, compile_lockstep(scene, shapes, options));
  return std::unique_ptr<Simulator>(std::make_unique<LockstepSimulator>(std::move(compiled)));
}

}  // namespace prescene::simulation
