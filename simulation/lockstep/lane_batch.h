// SPDX-License-Identifier: Apache-2.0
// Runs instances through the slots of an engine: what ends makes room for the next one in the queue.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "lane_engine.h"
#include "lane_instance.h"
#include "lane_rest.h"
#include "prescene/core/progress.h"

namespace prescene::simulation {

/// What two bodies did to each other in a step, numbered as in belief::ContactInterval.
struct LaneTouch {
  int first = 0, second = 0;
  double impulse = 0.0;   ///< N s
  double normal_z = 0.0;  ///< Along up_of(scene), of the mean normal from the second to the first.
};
/// Touching bodies of a slot's last step, ascending, into `touches` (scratch reused).
void touches_of(LaneEngine& engine, int slot, const LaneInstance& instance, std::vector<LaneTouch>& touches);

/// The instances of one call of Simulator::run, shared by its threads.
struct LaneQueue {
  std::span<const belief::WorldState> starts;
  const RunRequest* request = nullptr;
  std::span<const std::vector<belief::Action>> actions;  ///< Of each instance; empty = the request's.
  /// Which instances; empty = all.
  std::span<const std::size_t> members;
  std::span<belief::Trajectory> trajectories;
  const core::RandomStream* stream = nullptr;
  InstanceNumbers numbers = 0;
  const core::Cancellation* cancellation = nullptr;
  std::atomic<std::size_t> next{0};
};

class LaneBatch {
 public:
  explicit LaneBatch(std::shared_ptr<const CompiledLockstep> scene);

  const std::shared_ptr<const CompiledLockstep>& scene() const { return scene_; }

  /// Takes instances from the queue until it is empty and all taken are done; at most `live` at once.
  void run(LaneQueue& queue, int live);

 private:
  enum class Mode {
    kRuns,
    kCalm,    // calm for long enough; the next contacts found tell whether it stands
    kNudged,  // being nudged
  };
  struct Open {
    belief::ContactInterval interval;
    bool open = false;
  };
  struct Slot {
    explicit Slot(const CompiledLockstep& scene) : instance(scene), nudges(scene.lanes.objects) {}

    std::size_t index = 0;
    Mode mode = Mode::kRuns;
    LaneInstance instance;
    bool tested = false;  // and found to balance, in this calm
    double next_sample = 0.0;
    int until_asked = 0;  // steps until the end rule is asked
    std::vector<LaneTouch> touches;
    std::vector<Open> open;  // by pair
    NudgeTest nudges;
  };

  bool take(LaneQueue& queue);
  void start(Slot& slot, int at, std::size_t index, LaneQueue& queue);
  void test_balance();
  void after_step(int at);
  void note_touches(int at);
  void note_overlap(int at);
  /// Samples or ends a slot that goes on; the part of a step that a test of balance delays.
  void go_on(int at);
  void finish(int at, belief::TrajectoryEnd end);
  void skip_held(int at);
  void finish_at_rest(int at);
  /// Freezes what has left the world.
  void freeze_beyond(int at);
  Open& open_of(Slot& slot, const LaneTouch& touch) const {
    return slot.open[static_cast<std::size_t>(touch.first * bodies_ + touch.second)];
  }
  void remove_ended();

  std::shared_ptr<const CompiledLockstep> scene_;
  LaneEngine engine_;
  LaneQueue* queue_ = nullptr;
  std::vector<std::unique_ptr<Slot>> slots_;
  int live_ = 0;
  std::vector<std::uint8_t> steps_;  // by slot: moves in this step
  std::vector<std::uint8_t> wanted_;
  std::vector<std::uint8_t> ended_;
  belief::WorldState seen_;  // by the end rule
  int bodies_ = 0;           // as belief::ContactInterval numbers them
  std::int64_t most_steps_ = 0;
};

}  // namespace prescene::simulation
