// SPDX-License-Identifier: Apache-2.0
// One instance in a slot of an engine: its time, what its actions move, and for how long its objects have been calm.
#pragma once

#include <cmath>
#include <vector>

#include "lane_engine.h"
#include "prescene/simulation/rules/action_player.h"
#include "prescene/simulation/rules/byte_stream.h"

namespace prescene::simulation {

class LaneInstance {
 public:
  explicit LaneInstance(const CompiledLockstep& scene);

  /// `start` must live as long as the instance runs.
  void start(LaneEngine& engine, int slot, const belief::WorldState& start, const std::vector<belief::Action>& actions,
             const core::RandomStream& stream);
  /// What is to be done before LaneEngine::find_contacts: actions, and what they and timelines move.
  void before_step(LaneEngine& engine, int slot);
  /// After LaneEngine::advance. Of several objects, those that are at rest fall asleep.
  void after_step(LaneEngine& engine, int slot);
  /// Goes on by up to `most` steps at once in which everything is held and nothing is due; returns how many.
  std::int64_t skip_held(LaneEngine& engine, int slot, std::int64_t most);

  std::int64_t steps() const { return steps_; }
  /// Whether the last step was the first, or something was let go in it.
  bool began() const { return began_; }
  double time() const { return time_at(steps_); }
  double mass(int object) const { return start_->objects[static_cast<std::size_t>(object)].physical.mass; }
  /// Everything that moves by itself has been calm for long enough, and no action is to come.
  bool calm(const LaneEngine& engine, int slot) const;
  bool all_frozen(const LaneEngine& engine, int slot) const;
  void read(const LaneEngine& engine, int slot, belief::WorldState& state) const;

  void save(ByteWriter& out) const;
  void restore(ByteReader& in);

 private:
  double time_at(std::int64_t step) const { return start_->time + static_cast<double>(step) * dt_; }
  bool over() const { return !acts_ || (time() >= finish_time_ && std::isinf(next_due_) && !player_.slides()); }
  void run_due(LaneEngine& engine, int slot);
  void load(LaneEngine& engine, int slot);
  void set_free(LaneEngine& engine, int slot);

  const CompiledLockstep* scene_;
  double dt_;
  int rest_steps_;
  const belief::WorldState* start_ = nullptr;
  std::int64_t steps_ = 0;
  std::vector<int> calm_steps_;  // by object
  ActionPlayer player_;
  bool acts_ = false;  // something is held, moved by a timeline, or to be done
  double next_due_ = 0.0, finish_time_ = 0.0;
  bool began_ = false;
  bool driven_ = false;   // in this step, by a hand's force
  bool settled_ = false;  // nothing is moved from now on, and all is placed
  std::vector<geometry::Pose> poses_;
  std::vector<ActionPlayer::Released> released_;
  std::vector<ActionPlayer::Body> felt_;
  std::vector<ActionPlayer::Load> loads_;
};

}  // namespace prescene::simulation
