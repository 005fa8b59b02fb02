// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/bullet/bullet_simulator.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

#include "compiled_scene.h"
#include "contact_log.h"
#include "instance_world.h"
#include "prescene/core/check.h"
#include "prescene/simulation/rules/mechanics_hash.h"
#include "rest_detector.h"

namespace prescene::simulation {
namespace {

constexpr std::uint32_t kSnapshotVersion = 0x62540004;
// Between two looks at whether the run is cancelled; a step of a crowded scene takes 10 ms.
constexpr std::int64_t kCancellationTurns = 16;

/// What one thread needs to run instances one after another.
struct Worker {
  explicit Worker(std::shared_ptr<const CompiledScene> scene) : world(std::move(scene)) {}
  InstanceWorld world;
  RestDetector rest;
  ContactLog contacts;
  belief::WorldState seen;  // by the end rule
};

class BulletInstance : public Instance {
 public:
  BulletInstance(const std::shared_ptr<const CompiledScene>& scene, std::vector<belief::Action> actions,
                 const core::RandomStream& stream)
      : world_(scene),
        actions_(std::move(actions)),
        stream_(stream),
        scene_hash_(scene->hash),
        actions_hash_(mechanics_hash(actions_, stream_)) {
    set_state(belief::mean_start(scene->scene));
  }
  void set_state(const belief::WorldState& state) override {
    world_.reset(state, actions_, stream_);
    rest_.reset();
  }
  belief::WorldState state() const override {
    belief::WorldState state;
    world_.read(state);
    return state;
  }
  void step() override { world_.step(); }
  double step_size() const override { return world_.dt(); }
  bool at_rest() const override { return rest_.at_rest(world_); }
  Snapshot save() const override {
    Snapshot snapshot;
    ByteWriter out(snapshot.bytes);
    out.value(kSnapshotVersion);
    out.value(scene_hash_);
    out.value(actions_hash_);
    world_.save(out);
    return snapshot;
  }
  core::Status restore(const Snapshot& snapshot) override {
    const Snapshot now = save();
    rest_.reset();
    if (read(snapshot)) return core::ok_status();
    PRESCENE_CHECK(read(now));
    return core::invalid_input(
        "the snapshot is of another simulator, scene or list of actions; restore it where it was saved");
  }

 private:
  bool read(const Snapshot& snapshot) {
    ByteReader in(snapshot.bytes);
    return in.value<std::uint32_t>() == kSnapshotVersion && in.value<std::uint64_t>() == scene_hash_ &&
           in.value<std::uint64_t>() == actions_hash_ && world_.restore(in);
  }

  // Asking whether it rests nudges the world and puts it back, which leaves it as it was.
  mutable InstanceWorld world_;
  mutable RestDetector rest_;
  std::vector<belief::Action> actions_;
  core::RandomStream stream_;
  std::uint64_t scene_hash_, actions_hash_;
};

class BulletSimulator : public Simulator {
 public:
  explicit BulletSimulator(std::shared_ptr<const CompiledScene> scene) : scene_(std::move(scene)) {}

  StepperUse stepper() const override { return {"bullet", "", scene_->hull_error}; }

  void run(std::span<const belief::WorldState> starts, const RunRequest& request, const core::RandomStream& stream,
           InstanceNumbers numbers, core::ThreadPool& pool, std::span<belief::Trajectory> trajectories,
           const core::Cancellation* cancellation) const override {
    PRESCENE_CHECK(starts.size() == trajectories.size());
    pool.for_each_index(starts.size(), [&](std::size_t i) {
      std::unique_ptr<Worker> worker = take_worker();
      run_one(*worker, starts[i], request, stream.at(0, numbers[i]), trajectories[i], cancellation);
      give_back(std::move(worker));
    });
  }

  double step_size() const override { return scene_->options.step; }
  std::unique_ptr<Instance> make_instance(const std::vector<belief::Action>& actions,
                                          const core::RandomStream& stream) const override {
    return std::make_unique<BulletInstance>(scene_, actions, stream);
  }

 private:
  void run_one(Worker& worker, const belief::WorldState& start, const RunRequest& request,
               const core::RandomStream& stream, belief::Trajectory& trajectory,
               const core::Cancellation* cancellation) const;

  std::unique_ptr<Worker> take_worker() const {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<Worker> worker = std::move(idle_.back());
        idle_.pop_back();
        return worker;
      }
    }
    return std::make_unique<Worker>(scene_);
  }
  void give_back(std::unique_ptr<Worker> worker) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    idle_.push_back(std::move(worker));
  }

  std::shared_ptr<const CompiledScene> scene_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Worker>> idle_;
};

void BulletSimulator::run_one(Worker& worker, const belief::WorldState& start, const RunRequest& request,
                              const core::RandomStream& stream, belief::Trajectory& trajectory,
                              const core::Cancellation* cancellation) const {
  InstanceWorld& world = worker.world;
  world.reset(start, request.actions, stream);
  worker.rest.reset();
  worker.contacts.reset();
  trajectory = belief::Trajectory{};
  trajectory.states.push_back(start);
  trajectory.end = belief::TrajectoryEnd::kDuration;
  const double dt = world.dt();
  // A duration is met to the nearest step; rounding in its division must not add one.
  const auto steps = static_cast<std::int64_t>(std::ceil(request.stop.duration / dt - 1e-6));
  double next_sample = request.sample_interval;
  std::int64_t done = 0, flights = 0, turns = 0;
  int until_asked = request.end_rule_steps;
  while (done < steps) {
    // Counted by turns: a flight takes many steps in one, and could jump over every step that is looked at.
    if (cancellation && turns++ % kCancellationTurns == 0 && cancellation->requested()) {
      trajectory.end = belief::TrajectoryEnd::kCancelled;
      break;
    }
    if (scene_->options.skip_flight) {
      // Up to the step before the next that is kept or the last, which are taken as any other.
      const double until = request.sample_interval > 0.0 ? std::min(next_sample / dt - 1.5, steps - 1.0) : steps - 1.0;
      const int flown =
          world.fly(static_cast<int>(std::min(until - static_cast<double>(done), 1e6)), request.stop.world_radius);
      done += flown;
      flights += flown;
    }
    const double begin = world.time();
    if (!world.step(cancellation)) {
      trajectory.end = belief::TrajectoryEnd::kCancelled;
      break;
    }
    ++done;
    if (world.diverged()) {
      trajectory.end = belief::TrajectoryEnd::kDiverged;
      break;
    }
    trajectory.deepest_overlap = std::max(trajectory.deepest_overlap, world.overlap());
    worker.contacts.note(world.touches(), begin, world.time(), scene_->options.contact_merge_time);
    const bool left = world.freeze_beyond(request.stop.world_radius);
    const double elapsed = static_cast<double>(done) * dt;
    const bool last = done == steps;
    const bool ended = request.stop.stop_at_rest ? worker.rest.at_rest(world, cancellation) : world.all_frozen();
    if (ended) trajectory.end = left ? belief::TrajectoryEnd::kLeftTheWorld : belief::TrajectoryEnd::kAtRest;
    if (ended || last) break;
    if (request.end_rule && --until_asked <= 0) {
      until_asked = request.end_rule_steps;
      world.read(worker.seen);
      if (request.end_rule->ends(worker.seen, request.stop.duration - elapsed)) {
        trajectory.end = belief::TrajectoryEnd::kDecided;
        break;
      }
    }
    if (request.sample_interval > 0.0 && elapsed >= next_sample - 0.5 * dt) {
      trajectory.states.emplace_back();
      world.read(trajectory.states.back());
      while (next_sample - 0.5 * dt <= elapsed) next_sample += request.sample_interval;
    }
  }
  if (trajectory.end != belief::TrajectoryEnd::kDiverged) {
    belief::WorldState final_state;
    world.read(final_state);
    trajectory.states.push_back(std::move(final_state));
    for (const Touch& touch : world.touches()) trajectory.final_contacts.emplace_back(touch.first, touch.second);
  } else {
    // The last state that was kept is the last that means something.
    trajectory.states.push_back(trajectory.states.back());
  }
  worker.contacts.finish(trajectory.contacts);
  trajectory.simulated_seconds = static_cast<double>(done) * dt;
  trajectory.flown_seconds = static_cast<double>(flights) * dt;
}

}  // namespace

core::Result<std::unique_ptr<Simulator>> make_bullet_simulator(const belief::Scene& scene, ShapeStore& shapes,
                                                               const BulletOptions& options) {
  PRESCENE_TRY(auto compiled, compile_scene(scene, shapes, options));
  return std::unique_ptr<Simulator>(std::make_unique<BulletSimulator>(std::move(compiled)));
}

}  // namespace prescene::simulation
