// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/rules/action_player.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/belief/robot_motion.h"

namespace prescene::simulation {
namespace {

// s: what a grip holds feels that its hand stops in the step after; longer than any step.
constexpr double kFelt = 0.05;

/// Horizontal unit vector to the left of a direction of travel; zero when it is vertical.
Vector3d left_of(const Vector3d& travel) {
  const Vector3d left = Vector3d::UnitZ().cross(travel);
  const double norm = left.norm();
  return norm > 1e-12 ? Vector3d(left / norm) : Vector3d::Zero();
}

}  // namespace

void ActionPlayer::reset(const std::vector<belief::Action>& actions, const belief::WorldState& start,
                         core::RandomStream stream) {
  start_ = start.time;
  actions_ = actions;
  drawn_ = draw_actions(actions_, stream);
  steps_.assign(actions_.size(), Step{});
  pushers_.clear();
  bumps_.clear();
  drives_.clear();
  grips_ = false;
  for (std::size_t i = 0; i < actions_.size(); ++i) {
    const belief::Action& action = actions_[i];
    const auto* grasp = std::get_if<belief::Grasp>(&action.what);
    grips_ = grips_ || (grasp != nullptr && grasp->grip);
    if (std::holds_alternative<belief::Pull>(action.what) || std::holds_alternative<belief::MoveJoint>(action.what) ||
        std::holds_alternative<belief::Insert>(action.what))
      drives_.push_back(i);
    if (const auto* push = std::get_if<belief::Push>(&action.what)) {
      const Vector3d shift = drawn_[i].sideways * left_of(push->to - push->from);
      pushers_.push_back({push->from + shift, push->to + shift, action.time, push->duration, push->radius});
    }
  }
  hands_.assign(scene_->robot.size(), Hand{});
  objects_.assign(scene_->objects.size(), Hold{});
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (start.objects[i].mode != belief::MotionMode::kHeld) continue;
    Hold& hold = objects_[i];
    hold.control = Control::kHeld;
    const std::optional<std::string>& holder = scene_->objects[i].held_by;
    const std::optional<int> hand = holder ? belief::find_robot_body(*scene_, *holder) : std::nullopt;
    hold.hand = hand.value_or(-1);
    const Pose& X_WO = start.objects[i].X_WO;
    hold.X_GO = hand ? timeline_pose(*hand, start_).inverse() * X_WO : X_WO;
  }
}

Pose ActionPlayer::timeline_pose(int robot, double time) const {
  return belief::pose_at(scene_->robot[static_cast<std::size_t>(robot)], time);
}

Pose ActionPlayer::robot_pose(int robot, double time) const {
  const Hand& hand = hands_[static_cast<std::size_t>(robot)];
  if (hand.carries >= 0) {
    const Hold& hold = objects_[static_cast<std::size_t>(hand.carries)];
    return carrying_pose(hold, time) * hold.X_GO.inverse();
  }
  Pose X_WG = hand.stays ? hand.X_WG_stay : timeline_pose(robot, time);
  for (std::size_t i = 0; i < actions_.size(); ++i) {
    if (!steps_[i].done || steps_[i].hand != robot) continue;
    const auto& release = std::get<belief::Release>(actions_[i].what);
    X_WG.translation += belief::share_done(begin_of(i), release.retreat_duration, time) * release.retreat;
  }
  return X_WG;
}

Pose ActionPlayer::carried_pose(const Hold& hold, double time) const {
  const auto index = static_cast<std::size_t>(hold.action);
  const double share = belief::share_done(hold.begin, belief::duration_of(actions_[index]), time);
  if (const auto* pour = std::get_if<belief::Pour>(&actions_[index].what)) {
    Pose X_WO = hold.X_from;
    const Vector3d axis = pour->axis_W.normalized();
    X_WO.rotation = geometry::exp_rotation(share * pour->angle * axis) * hold.X_from.rotation;
    return X_WO;
  }
  if (const auto* tilt = std::get_if<belief::Tilt>(&actions_[index].what))
    return belief::turned_about(hold.X_from, tilt->pivot_O, tilt->axis_W, share * tilt->angle);
  if (const auto* insert = std::get_if<belief::Insert>(&actions_[index].what)) {
    Pose X_WO = hold.X_from;
    X_WO.translation +=
        belief::moved_share(hold.begin, insert->duration, time) * insert->distance * insert->axis_W.normalized();
    return X_WO;
  }
  return geometry::interpolate(hold.X_from, drawn_[index].goal, share);
}

Pose ActionPlayer::carrying_pose(const Hold& hold, double time) const {
  const bool inserts = std::holds_alternative<belief::Insert>(actions_[static_cast<std::size_t>(hold.action)].what);
  return inserts ? hold.X_felt : carried_pose(hold, time);
}

Pose ActionPlayer::object_pose(int object, double time) const {
  const Hold& hold = objects_[static_cast<std::size_t>(object)];
  return hold.shifted ? planned_pose(object, time) * hold.X_PO : planned_pose(object, time);
}

Pose ActionPlayer::planned_pose(int object, double time) const {
  const Hold& hold = objects_[static_cast<std::size_t>(object)];
  if (goes_its_way(object)) return carried_pose(hold, time);
  return hold.hand >= 0 ? robot_pose(hold.hand, time) * hold.X_GO : hold.X_GO;
}

bool ActionPlayer::goes_its_way(int object) const {
  const Hold& hold = objects_[static_cast<std::size_t>(object)];
  return is_carried(hold) && (hold.hand < 0 || hands_[static_cast<std::size_t>(hold.hand)].carries == object);
}

bool ActionPlayer::pusher_present(int pusher, double time) const {
  const Pusher& p = pushers_[static_cast<std::size_t>(pusher)];
  return time >= start_ + p.begin && time < start_ + p.begin + p.duration;
}

Vector3d ActionPlayer::pusher_position(int pusher, double time) const {
  const Pusher& p = pushers_[static_cast<std::size_t>(pusher)];
  return p.from + belief::share_done(start_ + p.begin, p.duration, time) * (p.to - p.from);
}

bool ActionPlayer::finished(double time) const { return time >= finish_time(); }

double ActionPlayer::finish_time() const {
  double last = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < actions_.size(); ++i)
    last = std::max(last, begin_of(i) + belief::duration_of(actions_[i]));
  for (const belief::KinematicBody& body : scene_->robot) {
    if (body.timeline.size() > 1) last = std::max(last, body.timeline.back().time);
  }
  return grips_ ? last + kFelt : last;
}

double ActionPlayer::next_due() const {
  double next = std::numeric_limits<double>::infinity();
  for (const Hold& hold : objects_) {
    if (!is_carried(hold)) continue;
    next = std::min(next, hold.begin + belief::duration_of(actions_[static_cast<std::size_t>(hold.action)]));
  }
  for (std::size_t i = 0; i < actions_.size(); ++i) {
    if (!steps_[i].done) next = std::min(next, begin_of(i));
  }
  return next;
}

bool ActionPlayer::over(double time) const {
  const auto done = [](const Step& step) { return step.done; };
  return finished(time) && std::all_of(steps_.begin(), steps_.end(), done) &&
         std::none_of(objects_.begin(), objects_.end(), is_carried) &&
         !slides();  // what sticks in a grip stays so while the hand rests
}

void ActionPlayer::advance(double time, double dt, const std::vector<Pose>& poses, std::vector<Released>& released) {
  // Times are met to the nearest step, and rounding of step * count must not delay one.
  const double due = time + 0.5 * dt;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const Hold& hold = objects_[i];
    if (!is_carried(hold)) continue;
    if (hold.begin + belief::duration_of(actions_[static_cast<std::size_t>(hold.action)]) > due) continue;
    finish_carry(static_cast<int>(i), time, dt, poses[i], released);
  }
  for (std::size_t i = 0; i < actions_.size(); ++i) {
    if (!steps_[i].done && begin_of(i) <= due) {
      steps_[i].done = true;
      execute(i, time, dt, poses, released);
    }
  }
}

void ActionPlayer::finish_carry(int object, double time, double dt, const Pose& X_now,
                                std::vector<Released>& released) {
  Hold& hold = objects_[static_cast<std::size_t>(object)];
  const auto index = static_cast<std::size_t>(hold.action);
  Twist V_WO;
  if (!goes_its_way(object)) {
    V_WO = leaving(object, time, dt, X_now);  // its hand carries something else, or stays where that ended
  } else {
    const Pose X_WO = carrying_pose(hold, hold.begin + belief::duration_of(actions_[index]));
    if (hold.hand >= 0) {
      stop(hold.hand, X_WO * hold.X_GO.inverse());
    } else {
      hold.X_GO = X_WO;
    }
  }
  hold.action = -1;
  if (belief::lets_go(actions_[index])) {
    // What slides or is inserted is free already.
    if (!hold.loose) released.push_back({object, V_WO});
    hold = Hold{};
  } else {
    hold.control = Control::kHeld;
  }
}

void ActionPlayer::stop(int robot, const Pose& X_WG) {
  hands_[static_cast<std::size_t>(robot)] = {-1, true, X_WG};
  // Where it backed off to before, it set out from.
  for (Step& step : steps_)
    if (step.hand == robot) step.hand = -1;
}

void ActionPlayer::execute(std::size_t index, double time, double dt, const std::vector<Pose>& poses,
                           std::vector<Released>& released) {
  const belief::Action& action = actions_[index];
  const auto object_of = [&](const std::string& name) { return belief::find_object(*scene_, name); };

  if (const auto* release = std::get_if<belief::Release>(&action.what)) {
    const std::optional<int> object = object_of(release->object);
    if (!object || objects_[static_cast<std::size_t>(*object)].control == Control::kFree) return;
    Hold& hold = objects_[static_cast<std::size_t>(*object)];
    const bool loose = hold.loose;  // free already: only the hand opens
    // It leaves with the velocity that the hand is about to have, without the retreat that begins now.
    Twist V_WO = leaving(*object, time, dt, poses[static_cast<std::size_t>(*object)]);
    V_WO.linear += drawn_[index].disturbance.linear;
    V_WO.angular += drawn_[index].disturbance.angular;
    if (hold.hand >= 0) {
      if (hands_[static_cast<std::size_t>(hold.hand)].carries == *object) stop(hold.hand, robot_pose(hold.hand, time));
      steps_[index].hand = hold.hand;
    }
    hold = Hold{};
    if (!loose) released.push_back({*object, V_WO});
    return;
  }
  if (const auto* grasp = std::get_if<belief::Grasp>(&action.what)) {
    const std::optional<int> object = object_of(grasp->object);
    const std::optional<int> hand = belief::find_robot_body(*scene_, grasp->hand);
    if (!object || !hand) return;
    for (std::size_t i = 0; i < hands_.size(); ++i)  // what carried it stops here
      if (hands_[i].carries == *object) stop(static_cast<int>(i), robot_pose(static_cast<int>(i), time));
    Hold& hold = objects_[static_cast<std::size_t>(*object)];
    hold = Hold{};
    hold.control = Control::kHeld;
    hold.hand = *hand;
    hold.X_GO = robot_pose(*hand, time).inverse() * poses[static_cast<std::size_t>(*object)];
    if (grasp->grip) {
      hold.limit = 2.0 * drawn_[index].force * drawn_[index].friction.value_or(1.0);
      hold.own_friction = drawn_[index].friction.has_value();
      hold.pad_length = grasp->grip->pad_length;
    }
    return;
  }
  if (std::holds_alternative<belief::Bump>(action.what)) {
    bumps_.push_back(index);
    return;
  }
  const auto carry = [&](const std::string& name, Control control) {
    const std::optional<int> object = object_of(name);
    if (!object) return;
    Hold& hold = objects_[static_cast<std::size_t>(*object)];
    // A hand goes as if nothing had slid in it.
    hold.X_from = hold.shifted || hold.loose ? planned_pose(*object, time) : poses[static_cast<std::size_t>(*object)];
    hold.X_felt = hold.X_from;
    hold.control = control;
    hold.action = static_cast<int>(index);
    hold.begin = time;
    if (hold.hand >= 0) hands_[static_cast<std::size_t>(hold.hand)].carries = *object;
  };
  if (const auto* place = std::get_if<belief::Place>(&action.what)) carry(place->object, Control::kCarried);
  if (const auto* transport = std::get_if<belief::Transport>(&action.what)) {
    carry(transport->object, Control::kCarried);
  }
  if (const auto* pour = std::get_if<belief::Pour>(&action.what)) carry(pour->container, Control::kPoured);
  if (const auto* tilt = std::get_if<belief::Tilt>(&action.what)) carry(tilt->object, Control::kPoured);
  if (const auto* insert = std::get_if<belief::Insert>(&action.what)) {
    const std::optional<int> object = object_of(insert->object);
    if (!object || objects_[static_cast<std::size_t>(*object)].lost) return;
    // The hand gives way from now on: it drives the object, which is free otherwise.
    if (kinematic(*object))
      released.push_back({*object, leaving(*object, time, dt, poses[static_cast<std::size_t>(*object)])});
    carry(insert->object, Control::kCarried);
    objects_[static_cast<std::size_t>(*object)].loose = true;
  }
}

Twist ActionPlayer::leaving(int object, double time, double dt, const Pose& X_now) const {
  const Pose X_next = object_pose(object, time + dt) * (object_pose(object, time).inverse() * X_now);
  Twist V_WO;
  V_WO.linear = (X_next.translation - X_now.translation) / dt;
  V_WO.angular = geometry::log_rotation(X_next.rotation * X_now.rotation.conjugate()) / dt;
  return V_WO;
}

void ActionPlayer::save(ByteWriter& out) const {
  out.value(start_);
  for (const Hold& hold : objects_) {
    out.value(hold.control);
    out.value(hold.hand);
    out.pose(hold.X_GO);
    out.value(hold.action);
    out.value(hold.begin);
    out.pose(hold.X_from);
    out.pose(hold.X_felt);
    out.value(hold.limit);
    out.value(hold.pad_length);
    for (const bool flag : {hold.own_friction, hold.loose, hold.lost, hold.shifted}) out.value(flag);
    out.pose(hold.X_PO);
  }
  for (const Hand& hand : hands_) {
    out.value(hand.carries);
    out.value(hand.stays);
    out.pose(hand.X_WG_stay);
  }
  for (const Step& step : steps_) {
    out.value(step.done);
    out.value(step.hand);
    out.value(step.begun);
    out.vector(step.from_W);
    out.value(step.from);
  }
}

void ActionPlayer::restore(ByteReader& in) {
  start_ = in.value<double>();
  for (Hold& hold : objects_) {
    hold.control = in.value<Control>();
    hold.hand = in.value<int>();
    hold.X_GO = in.pose();
    hold.action = in.value<int>();
    hold.begin = in.value<double>();
    hold.X_from = in.pose();
    hold.X_felt = in.pose();
    hold.limit = in.value<double>();
    hold.pad_length = in.value<double>();
    for (bool* flag : {&hold.own_friction, &hold.loose, &hold.lost, &hold.shifted}) *flag = in.value<bool>();
    hold.X_PO = in.pose();
  }
  for (Hand& hand : hands_) {
    hand.carries = in.value<int>();
    hand.stays = in.value<bool>();
    hand.X_WG_stay = in.pose();
  }
  for (Step& step : steps_) {
    step.done = in.value<bool>();
    step.hand = in.value<int>();
    step.begun = in.value<bool>();
    step.from_W = in.vector();
    step.from = in.value<double>();
  }
}

}  // namespace prescene::simulation
