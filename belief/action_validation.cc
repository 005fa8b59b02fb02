// SPDX-License-Identifier: Apache-2.0
// What validate(Scene) checks of actions.
#include <cmath>
#include <optional>
#include <variant>

#include "prescene/belief/scene.h"
#include "prescene/belief/validation.h"
#include "scene_checks.h"

namespace prescene::belief {
namespace {

using core::invalid_input;
using core::not_found;
using core::Status;

constexpr double kLargestTurn = 100.0;  // rad, of a pour or tilt
constexpr double kLeastLever = 1e-3;    // m, of a handle
constexpr ScalarRange kForceRange{0.0, 1e6, "give a force in N, at least 0 and at most 1e6", true};
constexpr ScalarRange kTorqueRange{0.0, 1e6, "give a torque in N m, at least 0 and at most 1e6", true};
constexpr ScalarRange kImpulseRange{-1e6, 1e6, "give an impulse in N s between -1e6 and 1e6"};

Status check_point(const Vector3d& point, const char* what) {
  if (!point.allFinite() || point.cwiseAbs().maxCoeff() > kLengthRange.high)
    return invalid_input(std::string(what) + " is out of range: " + kLengthRange.remedy);
  return {};
}

/// An object that a hand can hold.
Status check_held_name(const Scene& scene, const std::string& name) {
  PRESCENE_RETURN_IF_ERROR(check_object_name(scene, name));
  const std::optional<int> joint = joint_of(scene, name);
  if (!joint) return {};
  return invalid_input("'" + name + "' hangs on the joint '" + scene.joints[static_cast<std::size_t>(*joint)].name +
                       "', so that no hand can hold it: push it, or pull it with a robot body");
}

struct ActionCheck {
  const Scene& scene;
  Status operator()(const Release& release) const {
    PRESCENE_RETURN_IF_ERROR(check_held_name(scene, release.object));
    PRESCENE_RETURN_IF_ERROR(check_point(release.retreat, "the retreat"));
    PRESCENE_RETURN_IF_ERROR(check_vector(release.disturbance.linear, kSpeedRange).at("velocity"));
    PRESCENE_RETURN_IF_ERROR(check_vector(release.disturbance.angular, kSpeedRange).at("angular_velocity"));
    return check_finite_positive(release.retreat_duration, "a retreat_duration");
  }
  Status operator()(const Place& place) const { return check_move(place.object, place.X_WO, place.duration); }
  Status operator()(const Transport& transport) const {
    return check_move(transport.object, transport.X_WO, transport.duration);
  }
  Status operator()(const Push& push) const {
    PRESCENE_RETURN_IF_ERROR(check_point(push.from, "the path"));
    PRESCENE_RETURN_IF_ERROR(check_point(push.to, "the path"));
    PRESCENE_RETURN_IF_ERROR(check_finite_positive(push.duration, "a duration"));
    PRESCENE_RETURN_IF_ERROR(check_finite_positive(push.radius, "a radius"));
    return check_scalar(push.lateral_error, kLengthRange).at("lateral_error");
  }
  Status operator()(const Pour& pour) const {
    PRESCENE_RETURN_IF_ERROR(check_held_name(scene, pour.container));
    return check_turn(pour.axis_W, pour.angle, pour.duration);
  }
  Status operator()(const Tilt& tilt) const {
    PRESCENE_RETURN_IF_ERROR(check_held_name(scene, tilt.object));
    PRESCENE_RETURN_IF_ERROR(check_point(tilt.pivot_O, "the pivot"));
    return check_turn(tilt.axis_W, tilt.angle, tilt.duration);
  }
  Status operator()(const Bump& bump) const {
    PRESCENE_RETURN_IF_ERROR(check_object_name(scene, bump.object));
    PRESCENE_RETURN_IF_ERROR(check_vector(bump.impulse, kImpulseRange).at("impulse"));
    return bump.point_O ? check_point(*bump.point_O, "the point") : Status();
  }
  Status operator()(const Pull& pull) const {
    PRESCENE_RETURN_IF_ERROR(check_object_name(scene, pull.object));
    PRESCENE_RETURN_IF_ERROR(check_point(pull.by, "the way 'by'"));
    if (!(pull.by.norm() > 1e-9)) return invalid_input("it pulls nowhere: give the way of the hand, like [0.2, 0, 0]");
    PRESCENE_RETURN_IF_ERROR(check_finite_positive(pull.duration, "a duration"));
    PRESCENE_RETURN_IF_ERROR(check_scalar(pull.force, kForceRange).at("force"));
    return pull.point_O ? check_point(*pull.point_O, "the point") : Status();
  }
  Status operator()(const MoveJoint& move) const {
    const std::optional<int> index = find_joint(scene, move.joint);
    if (!index) return not_found("there is no joint '" + move.joint + "': name one of the scene's joints");
    const Joint& joint = scene.joints[static_cast<std::size_t>(*index)];
    if (joint.type != move.type)
      return invalid_input(
          "the joint '" + move.joint + "' is " +
          (move.type == JointType::kHinge ? "a slider: give 'to' in metres" : "a hinge: give 'to_deg' in degrees"));
    if (!std::isfinite(move.to) || move.to < joint.low - 1e-9 || move.to > joint.high + 1e-9)
      return invalid_input("the joint '" + move.joint + "' does not get there: give a position within its limits");
    PRESCENE_RETURN_IF_ERROR(check_finite_positive(move.duration, "a duration"));
    PRESCENE_RETURN_IF_ERROR(check_scalar(move.force, kForceRange).at("force"));
    if (move.handle_C) PRESCENE_RETURN_IF_ERROR(check_point(*move.handle_C, "the handle"));
    return check_lever(joint, move);
  }
  Status operator()(const Insert& insert) const {
    PRESCENE_RETURN_IF_ERROR(check_held_name(scene, insert.object));
    PRESCENE_RETURN_IF_ERROR(check_axis(insert.axis_W));
    PRESCENE_RETURN_IF_ERROR(check_finite_positive(insert.distance, "a distance"));
    PRESCENE_RETURN_IF_ERROR(check_finite_positive(insert.duration, "a duration"));
    PRESCENE_RETURN_IF_ERROR(check_scalar(insert.force, kForceRange).at("force"));
    return check_scalar(insert.torque, kTorqueRange).at("torque");
  }
  Status operator()(const Grasp& grasp) const {
    PRESCENE_RETURN_IF_ERROR(check_held_name(scene, grasp.object));
    if (!find_robot_body(scene, grasp.hand))
      return not_found("there is no robot body '" + grasp.hand + "': name one of the scene's robot bodies");
    if (!grasp.grip) return {};
    PRESCENE_RETURN_IF_ERROR(check_scalar(grasp.grip->force, kForceRange).at("grip_force"));
    if (grasp.grip->friction)
      PRESCENE_RETURN_IF_ERROR(check_scalar(*grasp.grip->friction, kFrictionRange).at("finger_friction"));
    return check_finite_positive(grasp.grip->pad_length, "a pad_length");
  }
  static Status check_axis(const Vector3d& axis) {
    if (axis.allFinite() && axis.norm() > 1e-9 && axis.norm() <= kLengthRange.high) return {};
    return invalid_input("the axis is not a direction: give one of some length, like [0, 1, 0]");
  }
  static Status check_turn(const Vector3d& axis, double angle, double duration) {
    PRESCENE_RETURN_IF_ERROR(check_axis(axis));
    if (!(std::abs(angle) <= kLargestTurn))
      return invalid_input("the angle is not a number between -100 and 100: give radians");
    return check_finite_positive(duration, "a duration");
  }
  /// A handle on the hinge's axis moves nothing.
  Status check_lever(const Joint& joint, const MoveJoint& move) const {
    const std::optional<int> child = find_object(scene, joint.child);
    if (joint.type != JointType::kHinge || !child) return {};
    const ObjectModel& model = scene.model_of(scene.objects[static_cast<std::size_t>(*child)]);
    const Vector3d arm = joint.X_PC0 * move.handle_C.value_or(mean(model.center_of_mass)) - joint.anchor_P;
    if (joint.axis_P.cross(arm).norm() >= kLeastLever) return {};
    return invalid_input("the handle is on the axis of the joint '" + move.joint +
                         "', where a hand turns nothing: give " +
                         (move.handle_C ? "another point" : "'handle', a point of '" + joint.child + "'"));
  }
  Status check_move(const std::string& object, const PoseDistribution& to, double duration) const {
    PRESCENE_RETURN_IF_ERROR(check_held_name(scene, object));
    PRESCENE_RETURN_IF_ERROR(check_pose(to));
    return check_finite_positive(duration, "a duration");
  }
};

}  // namespace

Status check_action(const Scene& scene, const Action& action) { return std::visit(ActionCheck{scene}, action.what); }

}  // namespace prescene::belief
