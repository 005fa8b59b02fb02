// SPDX-License-Identifier: Apache-2.0
#include "lane_instance.h"

#include <algorithm>

#include "lane_rest.h"

namespace prescene::simulation {

using geometry::Pose;

LaneInstance::LaneInstance(const CompiledLockstep& scene)
    : scene_(&scene),
      dt_(scene.options.step),
      rest_steps_(static_cast<int>(std::ceil(scene.options.rest.time / scene.options.step))),
      calm_steps_(scene.scene.objects.size(), 0),
      player_(scene.scene) {}

void LaneInstance::start(LaneEngine& engine, int slot, const belief::WorldState& start,
                         const std::vector<belief::Action>& actions, const core::RandomStream& stream) {
  start_ = &start;
  steps_ = 0;
  std::fill(calm_steps_.begin(), calm_steps_.end(), 0);
  engine.reset(slot, start);
  const bool holds = std::any_of(start.objects.begin(), start.objects.end(),
                                 [](const auto& object) { return object.mode == belief::MotionMode::kHeld; });
  acts_ = holds || !actions.empty() || !scene_->scene.robot.empty();
  settled_ = !acts_;
  player_.reset(actions, start, stream);
  next_due_ = player_.next_due();
  finish_time_ = player_.finish_time();
}

void LaneInstance::run_due(LaneEngine& engine, int slot) {
  const double now = time();
  poses_.clear();
  for (int i = 0; i < engine.objects(); ++i) {
    if (player_.kinematic(i)) {
      poses_.push_back(player_.object_pose(i, now));
      continue;
    }
    belief::ObjectState object = start_->objects[static_cast<std::size_t>(i)];
    engine.read(slot, i, object);
    poses_.push_back(object.X_WO);
  }
  released_.clear();
  player_.advance(now, dt_, poses_, released_);
  set_free(engine, slot);
  next_due_ = player_.next_due();
}

void LaneInstance::set_free(LaneEngine& engine, int slot) {
  began_ = began_ || !released_.empty();
  for (const ActionPlayer::Released& event : released_) {
    const auto object = static_cast<std::size_t>(event.object);
    engine.release(slot, event.object, poses_[object], event.V_WO);
    calm_steps_[object] = 0;
  }
}

void LaneInstance::load(LaneEngine& engine, int slot) {
  const double now = time();
  poses_.clear();
  felt_.clear();
  for (int i = 0; i < engine.objects(); ++i) {
    belief::ObjectState object = start_->objects[static_cast<std::size_t>(i)];
    engine.read(slot, i, object);
    if (player_.kinematic(i)) object.X_WO = player_.object_pose(i, now);
    poses_.push_back(object.X_WO);
    felt_.push_back({object.X_WO, object.X_WO * object.physical.center_of_mass, engine.velocity(slot, i),
                     object.V_WO.angular, object.physical.mass, object.physical.friction});
  }
  released_.clear();
  loads_.clear();
  player_.load(now, dt_, felt_, released_, loads_);
  set_free(engine, slot);
  for (const ActionPlayer::Load& load : loads_) {
    driven_ = driven_ || !load.blow;
    engine.strike(slot, load.object, mass(load.object), load.impulse, load.turn, load.blow ? 0.0 : dt_);
    if (load.keeps_attitude) engine.turn_with(slot, load.object, load.spin);
    calm_steps_[static_cast<std::size_t>(load.object)] = 0;
  }
}

void LaneInstance::before_step(LaneEngine& engine, int slot) {
  began_ = steps_ == 0;
  driven_ = false;
  engine.drive(slot, false);
  if (settled_) return;
  const double now = time();
  // As ActionPlayer::advance: times are met to the nearest step.
  if (next_due_ <= now + 0.5 * dt_) run_due(engine, slot);
  if (player_.has_loads(now)) load(engine, slot);
  engine.drive(slot, driven_);
  for (std::size_t i = 0; i < scene_->robot_bodies.size(); ++i) {
    const int body = scene_->robot_bodies[i];
    const int robot = static_cast<int>(i);
    if (body >= 0) engine.place(slot, body, player_.robot_pose(robot, now), player_.robot_pose(robot, now + dt_));
  }
  for (std::size_t i = 0; i < scene_->pushers.size(); ++i) {
    const int body = scene_->pusher_body(i);
    const int pusher = static_cast<int>(i);
    if (player_.pusher_present(pusher, now)) {
      engine.place(slot, body, Pose::from_translation(player_.pusher_position(pusher, now)),
                   Pose::from_translation(player_.pusher_position(pusher, now + dt_)));
    } else {
      engine.remove(slot, body);
    }
  }
  for (int i = 0; i < engine.objects(); ++i) {
    if (!player_.kinematic(i) || engine.motion(slot, i) == LaneMotion::kFrozen) continue;
    engine.hold(slot, i, player_.object_pose(i, now), player_.object_pose(i, now + dt_));
  }
  settled_ = over();
}

void LaneInstance::after_step(LaneEngine& engine, int slot) {
  ++steps_;
  const bool may_sleep = engine.objects() > 1 && over();
  for (int i = 0; i < engine.objects(); ++i) {
    int& calm = calm_steps_[static_cast<std::size_t>(i)];
    if (engine.motion(slot, i) == LaneMotion::kAsleep) {
      ++calm;
      continue;
    }
    calm = engine.free(slot, i) && engine.energy(slot, i) < scene_->options.rest.energy ? calm + 1 : 0;
    if (may_sleep && calm > 0 && calm >= rest_steps_ && lies_still(engine, slot, i)) engine.fall_asleep(slot, i);
  }
}

std::int64_t LaneInstance::skip_held(LaneEngine& engine, int slot, std::int64_t most) {
  if (settled_ || most < 2 || player_.has_loads(time())) return 0;
  for (int i = 0; i < engine.objects(); ++i) {
    if (!player_.kinematic(i) || engine.motion(slot, i) == LaneMotion::kFrozen) return 0;
  }
  // Up to the step before the one that does something, or after which no action is to come.
  const double now = time();
  double until = next_due_;
  if (finish_time_ > now) until = std::min(until, finish_time_);
  const double left = (until - now) / dt_ - 1.5;
  if (left < 2.0) return 0;
  const std::int64_t count = std::min(most, static_cast<std::int64_t>(std::min(left, 1e9)));
  steps_ += count;
  for (int i = 0; i < engine.objects(); ++i) {
    engine.hold(slot, i, player_.object_pose(i, time() - dt_), player_.object_pose(i, time()));
    engine.arrive(slot, i);
  }
  return count;
}

bool LaneInstance::calm(const LaneEngine& engine, int slot) const {
  for (int i = 0; i < engine.objects(); ++i) {
    if (engine.free(slot, i) && calm_steps_[static_cast<std::size_t>(i)] < rest_steps_) return false;
  }
  return over();
}

bool LaneInstance::all_frozen(const LaneEngine& engine, int slot) const {
  for (int i = 0; i < engine.objects(); ++i) {
    if (engine.motion(slot, i) != LaneMotion::kFrozen) return false;
  }
  return true;
}

void LaneInstance::read(const LaneEngine& engine, int slot, belief::WorldState& state) const {
  state = *start_;
  state.time = time();
  for (int i = 0; i < engine.objects(); ++i) {
    belief::ObjectState& object = state.objects[static_cast<std::size_t>(i)];
    // What is held until the first step is as the start says.
    if (steps_ > 0) engine.read(slot, i, object);
    const bool held = acts_ && player_.kinematic(i);
    const bool rests = calm_steps_[static_cast<std::size_t>(i)] >= rest_steps_;
    object.mode = held ? belief::MotionMode::kHeld : rests ? belief::MotionMode::kResting : belief::MotionMode::kMoving;
  }
}

void LaneInstance::save(ByteWriter& out) const {
  out.value(steps_);
  for (const int calm : calm_steps_) out.value(calm);
  out.value(acts_);
  player_.save(out);
}

void LaneInstance::restore(ByteReader& in) {
  steps_ = in.value<std::int64_t>();
  for (int& calm : calm_steps_) calm = in.value<int>();
  acts_ = in.value<bool>();
  settled_ = !acts_;
  player_.restore(in);
  next_due_ = player_.next_due();
}

}  // namespace prescene::simulation
