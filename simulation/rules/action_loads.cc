// SPDX-License-Identifier: Apache-2.0
// ActionPlayer: blows, and hands that are only as strong as they are said to be. All of these give an object what it
// takes to move as the hand does in this step, and no more than the hand can: with a force of friction between fingers
// that is Coulomb's law in Moreau's form (stick where the limit suffices, else the limit against the slip), whatever
// the step.
#include <algorithm>
#include <cmath>

#include "prescene/belief/robot_motion.h"
#include "prescene/simulation/rules/action_player.h"
#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {
namespace {

// A hand that has been held up goes on at most so many times as fast as it is meant to.
constexpr double kCatchUp = 2.0;
// rad/s: how fast a hand that inserts something turns it back.
constexpr double kTurnBack = 2.0;
// Share by which a limit may be exceeded by rounding.
constexpr double kRounding = 1e-9;

Vector3d at_most(const Vector3d& vector, double length) {
  const double norm = vector.norm();
  return norm > length ? Vector3d(length / norm * vector) : vector;
}

}  // namespace

bool ActionPlayer::under_way(std::size_t action, double time) const {
  return steps_[action].done && time < begin_of(action) + belief::duration_of(actions_[action]) * (1.0 - kRounding);
}

bool ActionPlayer::has_loads(double time) const {
  if (!bumps_.empty()) return true;
  if (std::any_of(drives_.begin(), drives_.end(), [&](std::size_t action) { return under_way(action, time); }))
    return true;
  return grips_ && std::any_of(objects_.begin(), objects_.end(), [](const Hold& hold) { return hold.acts(); });
}

void ActionPlayer::load(double time, double dt, std::span<const Body> bodies, std::vector<Released>& released,
                        std::vector<Load>& loads) {
  const Loading now{time, dt, bodies, released, loads};
  std::vector<Vector3d> blows(objects_.size(), Vector3d::Zero());
  for (const std::size_t action : bumps_) bump(action, now, blows);
  for (std::size_t i = 0; grips_ && i < objects_.size(); ++i)
    if (objects_[i].acts()) grip(static_cast<int>(i), blows[i], now);
  for (const std::size_t action : drives_) {
    if (!under_way(action, time)) continue;
    if (std::holds_alternative<belief::Pull>(actions_[action].what)) pull(action, now);
    if (std::holds_alternative<belief::MoveJoint>(actions_[action].what)) move_joint(action, now);
    if (std::holds_alternative<belief::Insert>(actions_[action].what)) insert(action, now);
  }
  bumps_.clear();
}

bool ActionPlayer::slides() const {
  return grips_ &&
         std::any_of(objects_.begin(), objects_.end(), [](const Hold& hold) { return hold.acts() && hold.loose; });
}

void ActionPlayer::bump(std::size_t action, const Loading& now, std::vector<Vector3d>& blows) const {
  const auto& bump = std::get<belief::Bump>(actions_[action].what);
  const std::optional<int> object = belief::find_object(*scene_, bump.object);
  if (!object) return;
  const auto index = static_cast<std::size_t>(*object);
  const Body& body = now.bodies[index];
  const Vector3d& impulse = drawn_[action].impulse;
  blows[index] += impulse;
  if (kinematic(*object)) return;  // what a hand holds it takes, unless a grip loses it
  Load load{*object, impulse};
  if (bump.point_O) load.turn = (body.X_WO * *bump.point_O - body.p_WCm).cross(impulse);
  load.blow = true;
  now.loads.push_back(load);
}

void ActionPlayer::grip(int object, const Vector3d& blow, const Loading& now) {
  Hold& hold = objects_[static_cast<std::size_t>(object)];
  if (hold.action >= 0 && std::holds_alternative<belief::Insert>(actions_[static_cast<std::size_t>(hold.action)].what))
    return;  // which is driven by its own force
  const Body& body = now.bodies[static_cast<std::size_t>(object)];
  const Pose X_begin = planned_pose(object, now.time), X_end = planned_pose(object, now.time + now.dt);
  if (hold.loose && (X_begin.inverse() * body.X_WO).translation.norm() > hold.pad_length) {
    hold.lost = true;
    return;
  }
  // As steppers do: the velocity of the object's origin, and the spin about it.
  const Vector3d& origin = body.X_WO.translation;
  const Vector3d spin = geometry::log_rotation(X_end.rotation * X_begin.rotation.conjugate()) / now.dt;
  const Vector3d velocity = (X_end * (X_begin.inverse() * origin) - origin) / now.dt + spin.cross(body.p_WCm - origin);
  double limit = hold.limit;
  if (!hold.own_friction) {
    const belief::KinematicBody& hand = scene_->robot[static_cast<std::size_t>(hold.hand)];
    SurfaceCoefficients surface;
    surface.friction = body.friction;
    limit *= pair_of(surface, mean_coefficients(hand.contact)).friction;
  }
  const Vector3d needed = body.mass * (velocity - body.v_WCm - now.dt * scene_->gravity_W) - blow;
  if (needed.norm() <= (1.0 + kRounding) * limit * now.dt) {
    if (hold.loose) {
      hold.X_PO = X_begin.inverse() * body.X_WO;
      hold.shifted = true;
      hold.loose = false;
    }
    return;
  }
  if (!hold.loose) {
    hold.loose = true;
    Twist V_WO;
    V_WO.angular = body.w_WO;
    V_WO.linear = body.v_WCm - body.w_WO.cross(body.p_WCm - body.X_WO.translation);
    now.released.push_back({object, V_WO});
    if (!blow.isZero(0.0)) {
      Load load{object, blow};
      load.blow = true;
      now.loads.push_back(load);
    }
  }
  Load load{object, at_most(needed, limit * now.dt)};
  load.keeps_attitude = true;
  load.spin = spin;
  now.loads.push_back(load);
}

geometry::Matrix3d ActionPlayer::inverse_inertia(int object, const Body& body) const {
  const belief::ObjectModel& model = scene_->model_of(scene_->objects[static_cast<std::size_t>(object)]);
  const geometry::Matrix3d R = body.X_WO.rotation.toRotationMatrix();
  return R * (body.mass * model.unit_inertia).inverse() * R.transpose();
}

/// Draws the point along a direction.
void ActionPlayer::draw_at(int object, const Vector3d& point_W, const Vector3d& along, const Drawing& drawing,
                           const Loading& now) const {
  const Body& body = now.bodies[static_cast<std::size_t>(object)];
  const Vector3d arm = point_W - body.p_WCm;
  const Vector3d lever = arm.cross(along);
  // As of a free body: what else holds it makes it harder to move, so that this is never too much.
  const double response = 1.0 / body.mass + lever.dot(inverse_inertia(object, body) * lever);
  const double speed_now = along.dot(body.v_WCm + body.w_WO.cross(arm) + now.dt * scene_->gravity_W);
  // A hand that is held up pulls as hard as it can, whatever the step.
  const double fastest = std::max(drawing.fastest, drawing.most * response);
  const double speed = drawing.base_speed + std::clamp(drawing.behind / now.dt, -fastest, fastest);
  const double impulse =
      std::clamp((speed - speed_now) / response, drawing.draws_only ? 0.0 : -drawing.most, drawing.most);
  Load load{object, impulse * along};
  load.turn = impulse * lever;
  now.loads.push_back(load);
}

void ActionPlayer::pull(std::size_t action, const Loading& now) {
  const auto& pull = std::get<belief::Pull>(actions_[action].what);
  const std::optional<int> object = belief::find_object(*scene_, pull.object);
  if (!object || kinematic(*object)) return;
  const Body& body = now.bodies[static_cast<std::size_t>(*object)];
  const Vector3d point = pull.point_O ? Vector3d(body.X_WO * *pull.point_O) : body.p_WCm;
  Step& step = steps_[action];
  if (!step.begun) {
    step.begun = true;
    step.from_W = point;
  }
  const double way = pull.by.norm();
  const Vector3d along = pull.by / way;
  Drawing drawing;
  drawing.behind =
      way * belief::share_done(begin_of(action), pull.duration, now.time + now.dt) - along.dot(point - step.from_W);
  drawing.fastest = kCatchUp * way / pull.duration;
  drawing.most = drawn_[action].force * now.dt;
  drawing.draws_only = true;
  draw_at(*object, point, along, drawing, now);
}

void ActionPlayer::move_joint(std::size_t action, const Loading& now) {
  const auto& move = std::get<belief::MoveJoint>(actions_[action].what);
  const std::optional<int> index = belief::find_joint(*scene_, move.joint);
  if (!index) return;
  const belief::Joint& joint = scene_->joints[static_cast<std::size_t>(*index)];
  const std::optional<int> child = belief::find_object(*scene_, joint.child);
  if (!child) return;
  const Body& body = now.bodies[static_cast<std::size_t>(*child)];
  Pose X_WP;
  Body parent;
  if (const auto object = belief::find_object(*scene_, joint.parent)) {
    parent = now.bodies[static_cast<std::size_t>(*object)];
    X_WP = parent.X_WO;
  } else if (const auto support = belief::find_support(*scene_, joint.parent)) {
    X_WP = scene_->supports[static_cast<std::size_t>(*support)].X_WS;
  }
  const double position = belief::joint_state(joint, X_WP, Twist{}, body.X_WO, Twist{}).position;
  Step& step = steps_[action];
  if (!step.begun) {
    step.begun = true;
    step.from = position;
  }
  const Vector3d point = move.handle_C ? Vector3d(body.X_WO * *move.handle_C) : body.p_WCm;
  Vector3d along = X_WP.rotation * joint.axis_P;  // of the handle, for one rad or m of the joint
  if (joint.type == belief::JointType::kHinge) along = along.cross(point - X_WP * joint.anchor_P).eval();
  const double lever = along.norm();
  if (!(lever > 0.0)) return;
  along /= lever;
  const double way = move.to - step.from;
  Drawing drawing;
  drawing.behind =
      lever * (step.from - position + way * belief::moved_share(begin_of(action), move.duration, now.time + now.dt));
  drawing.fastest = kCatchUp * lever * std::abs(way) / (belief::kMovingShare * move.duration);
  if (belief::find_object(*scene_, joint.parent))
    drawing.base_speed = along.dot(parent.v_WCm + parent.w_WO.cross(point - parent.p_WCm));
  drawing.most = drawn_[action].force * now.dt;
  draw_at(*child, point, along, drawing, now);
}

void ActionPlayer::insert(std::size_t action, const Loading& now) {
  const auto& insert = std::get<belief::Insert>(actions_[action].what);
  const std::optional<int> object = belief::find_object(*scene_, insert.object);
  if (!object) return;
  Hold& hold = objects_[static_cast<std::size_t>(*object)];
  if (hold.action != static_cast<int>(action)) return;  // it was let go of, or grasped anew
  const Body& body = now.bodies[static_cast<std::size_t>(*object)];
  hold.X_felt = hold.shifted ? body.X_WO * hold.X_PO.inverse() : body.X_WO;
  const Pose X_goal = object_pose(*object, now.time + now.dt);
  const geometry::Matrix3d response = inverse_inertia(*object, body);
  const double most = drawn_[action].force * now.dt, most_turn = drawn_[action].torque * now.dt;
  const double fastest =
      std::max(kCatchUp * insert.distance / (belief::kMovingShare * insert.duration), most / body.mass);
  const Vector3d p_goal = X_goal * (body.X_WO.inverse() * body.p_WCm);
  // Beside its line the hand gives way no more for being held up along it.
  const Vector3d axis = insert.axis_W.normalized(), behind = p_goal - body.p_WCm;
  const Vector3d along = axis.dot(behind) * axis;
  const Vector3d velocity = at_most(along / now.dt, fastest) + at_most((behind - along) / now.dt, fastest);
  const Vector3d turned = geometry::log_rotation(X_goal.rotation * body.X_WO.rotation.conjugate());
  const Vector3d spin = at_most(turned / now.dt, std::max(kTurnBack, most_turn * response.norm()));
  Load load{*object, at_most(body.mass * (velocity - body.v_WCm - now.dt * scene_->gravity_W), most)};
  load.turn = at_most(response.inverse() * (spin - body.w_WO), most_turn);
  now.loads.push_back(load);
}

}  // namespace prescene::simulation
