// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/lockstep/lockstep_simulator.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <utility>

#include "compile_scene.h"
#include "lane_batch.h"
#include "prescene/core/check.h"

namespace prescene::simulation {
namespace {

constexpr std::uint32_t kSnapshotVersion = 0x4c4b0001;

class LockstepInstance : public Instance {
 public:
  explicit LockstepInstance(std::shared_ptr<const CompiledLockstep> scene)
      : scene_(std::move(scene)), engine_(scene_, 1) {
    set_state(belief::mean_start(scene_->scene));
  }

  void set_state(const belief::WorldState& state) override {
    PRESCENE_CHECK(state.objects.size() == 1);
    kept_ = {};
    start_ = state;
    engine_.reset(0, state.objects.front());
  }

  belief::WorldState state() const override {
    belief::WorldState state = start_;
    state.time = start_.time + static_cast<double>(kept_.steps) * step_size();
    engine_.read(0, state.objects.front());
    state.objects.front().mode =
        kept_.calm_steps >= rest_steps() ? belief::MotionMode::kResting : belief::MotionMode::kMoving;
    return state;
  }

  void step() override {
    engine_.find_contacts(one_);
    engine_.advance(one_);
    ++kept_.steps;
    kept_.calm_steps = engine_.energy(0) < scene_->options.rest.energy ? kept_.calm_steps + 1 : 0;
    if (kept_.calm_steps < rest_steps()) kept_.tested = kept_.stable = false;
  }

  double step_size() const override { return scene_->options.step; }

  bool at_rest() const override {
    if (kept_.calm_steps < rest_steps()) return false;
    if (!kept_.tested) {
      kept_.tested = true;
      kept_.stable = balances();
    }
    return kept_.stable;
  }

  Snapshot save() const override {
    SlotState slot{};
    engine_.save(0, slot);
    Snapshot snapshot;
    const auto put = [&](const auto& value) {
      const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
      snapshot.bytes.insert(snapshot.bytes.end(), bytes, bytes + sizeof(value));
    };
    put(kSnapshotVersion);
    put(kept_.steps);
    put(kept_.calm_steps);
    put(start_.time);
    const belief::PhysicalParameters& physical = start_.objects.front().physical;
    put(physical.mass);
    for (int i = 0; i < 3; ++i) put(physical.center_of_mass[i]);
    put(physical.friction);
    put(physical.impact_friction);
    put(physical.restitution);
    put(slot);
    return snapshot;
  }

  core::Status restore(const Snapshot& snapshot) override {
    std::size_t at = 0;
    bool whole = true;
    const auto get = [&](auto& value) {
      whole = whole && at + sizeof(value) <= snapshot.bytes.size();
      if (whole) std::memcpy(&value, snapshot.bytes.data() + at, sizeof(value));
      at += sizeof(value);
    };
    std::uint32_t version = 0;
    Kept kept;
    belief::WorldState start = start_;
    SlotState slot{};
    get(version);
    get(kept.steps);
    get(kept.calm_steps);
    get(start.time);
    belief::PhysicalParameters& physical = start.objects.front().physical;
    get(physical.mass);
    for (int i = 0; i < 3; ++i) get(physical.center_of_mass[i]);
    get(physical.friction);
    get(physical.impact_friction);
    get(physical.restitution);
    get(slot);
    if (!whole || at != snapshot.bytes.size() || version != kSnapshotVersion || slot.warm_count < 0 ||
        slot.warm_count > kMaxContacts) {
      return core::invalid_input("the snapshot is of another simulator or scene; restore it where it was saved");
    }
    kept_ = kept;
    start_ = std::move(start);
    engine_.reset(0, start_.objects.front());
    engine_.restore(0, slot);
    return core::ok_status();
  }

 private:
  struct Kept {
    std::int64_t steps = 0;
    int calm_steps = 0;
    bool tested = false;
    bool stable = false;
  };

  int rest_steps() const { return static_cast<int>(std::ceil(scene_->options.rest.time / scene_->options.step)); }

  /// Moves the object and puts it back.
  bool balances() const {
    engine_.find_contacts(one_);
    const LaneFooting footing = footing_of(engine_, 0);
    if (footing.firm) return true;
    NudgeTest nudges;
    nudges.begin(engine_, 0, footing.height);
    for (;;) {
      engine_.find_contacts(one_);
      engine_.advance(one_);
      const NudgeTest::Verdict verdict = nudges.after_step(engine_, 0);
      if (verdict != NudgeTest::Verdict::kGoesOn) return verdict == NudgeTest::Verdict::kReturns;
    }
  }

  std::shared_ptr<const CompiledLockstep> scene_;
  // Asking whether it rests nudges the object and puts it back, which leaves it as it was.
  mutable LaneEngine engine_;
  mutable Kept kept_;
  belief::WorldState start_;
  std::vector<std::uint8_t> one_ = {1};
};

class LockstepSimulator : public Simulator {
 public:
  explicit LockstepSimulator(std::shared_ptr<const CompiledLockstep> scene) : scene_(std::move(scene)) {}

  void run(std::span<const belief::WorldState> starts, const RunRequest& request, const core::RandomStream&,
           std::uint32_t, core::ThreadPool& pool, std::span<belief::Trajectory> trajectories,
           const core::Cancellation* cancellation) const override {
    PRESCENE_CHECK(starts.size() == trajectories.size());
    PRESCENE_CHECK(lockstep_supports(request, starts).ok());
    if (starts.empty()) return;
    LaneQueue queue;
    queue.starts = starts;
    queue.request = &request;
    queue.trajectories = trajectories;
    queue.cancellation = cancellation;
    // Each thread gets its share of the instances at once, so that none waits for another's.
    const auto threads = std::min(static_cast<std::size_t>(pool.threads()), starts.size());
    const auto share = static_cast<int>((starts.size() + threads - 1) / threads);
    pool.for_each_index(threads, [&](std::size_t) {
      std::unique_ptr<LaneBatch> batch = take_batch();
      batch->run(queue, std::min(share, scene_->options.live_instances));
      give_back(std::move(batch));
    });
  }

  std::unique_ptr<Instance> make_instance(const std::vector<belief::Action>& actions,
                                          const core::RandomStream&) const override {
    RunRequest request;
    request.actions = actions;
    PRESCENE_CHECK(lockstep_supports(request).ok());
    return std::make_unique<LockstepInstance>(scene_);
  }

 private:
  std::unique_ptr<LaneBatch> take_batch() const {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<LaneBatch> batch = std::move(idle_.back());
        idle_.pop_back();
        return batch;
      }
    }
    return std::make_unique<LaneBatch>(scene_);
  }
  void give_back(std::unique_ptr<LaneBatch> batch) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    idle_.push_back(std::move(batch));
  }

  std::shared_ptr<const CompiledLockstep> scene_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<LaneBatch>> idle_;
};

}  // namespace

core::Result<std::unique_ptr<Simulator>> make_lockstep_simulator(const belief::Scene& scene, ShapeStore& shapes,
                                                                 const LockstepOptions& options) {
  PRESCENE_TRY(auto compiled, compile_lockstep(scene, shapes, options));
  return std::unique_ptr<Simulator>(std::make_unique<LockstepSimulator>(std::move(compiled)));
}

}  // namespace prescene::simulation
