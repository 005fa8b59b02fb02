// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <set>

#include "prescene/belief/scene.h"
#include "prescene/belief/validation.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"

namespace prescene::belief {
namespace {

using core::invalid_input;
using core::not_found;
using core::Status;

constexpr double kMostTurns = 100.0;  // rad of a pour
constexpr double kLeastLever = 1e-3;  // m, of a handle
constexpr ScalarRange kForceRange{0.0, 1e6, "give a force in N, at least 0 and at most 1e6", true};
constexpr ScalarRange kTorqueRange{0.0, 1e6, "give a torque in N m, at least 0 and at most 1e6", true};
constexpr ScalarRange kImpulseRange{-1e6, 1e6, "give an impulse in N s between -1e6 and 1e6"};

std::string quoted(const char* what, const std::string& name) { return std::string(what) + " '" + name + "'"; }

Status check_finite_positive(double value, const char* what) {
  if (!(value > 0.0) || !(value <= 1e6))
    return invalid_input(std::string(what) + " of " + std::to_string(value) + ": give more than 0 and at most 1e6");
  return {};
}

Status check_object_name(const Scene& scene, const std::string& name) {
  if (!find_object(scene, name)) return not_found("there is no object '" + name + "': name one of the scene's objects");
  return {};
}

Status check_point(const Vector3d& point, const char* what) {
  if (!point.allFinite() || point.cwiseAbs().maxCoeff() > kLengthRange.high)
    return invalid_input(std::string(what) + " is out of range: " + kLengthRange.remedy);
  return {};
}

bool is_thing(const Scene& scene, const std::string& name) {
  return find_object(scene, name) || find_support(scene, name) || find_robot_body(scene, name);
}

Status check_thing(const Scene& scene, const std::string& name) {
  if (!is_thing(scene, name))
    return not_found("there is no '" + name + "': name an object, a support or a robot body of the scene");
  return {};
}

Status check_depth_noise(const DepthNoiseSettings& noise) {
  if (const auto sigma = noise.sigma_per_depth_squared; sigma && !(*sigma > 0.0 && *sigma <= 1.0))
    return invalid_input("sigma_per_depth_squared of " + std::to_string(*sigma) + ": give more than 0 and at most 1");
  const auto check_share = [](const char* what, double share) {
    if (share >= 0.0 && share < 1.0) return Status();
    return invalid_input(std::string(what) + " of " + std::to_string(share) + ": give at least 0 and less than 1");
  };
  if (noise.incidence_knee) PRESCENE_RETURN_IF_ERROR(check_share("incidence_knee", *noise.incidence_knee));
  if (noise.incidence_missing)
    for (const double share : *noise.incidence_missing)
      PRESCENE_RETURN_IF_ERROR(check_share("incidence_missing", share));
  if (noise.outline_missing)
    for (const double share : *noise.outline_missing) PRESCENE_RETURN_IF_ERROR(check_share("outline_missing", share));
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
    if (!(std::abs(angle) <= kMostTurns))
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

// rad, and a little for ends that were given in degrees.
constexpr double kHalfTurn = std::numbers::pi + 1e-9;

/// "0 and 0.3 m", "-90 and 0 degrees".
std::string ends_of(const Joint& joint) {
  const bool hinge = joint.type == JointType::kHinge;
  const auto text = [&](double value) {
    return core::rounded_text(hinge ? value * geometry::kDegreesPerRadian : value);
  };
  return text(joint.low) + " and " + text(joint.high) + (hinge ? " degrees" : " m");
}

struct PredicateCheck {
  const Scene& scene;
  const std::string& object;  // that is judged
  Status operator()(const InsideVolume& inside) const {
    PRESCENE_RETURN_IF_ERROR(check_pose(inside.X_WV));
    for (int i = 0; i < 3; ++i) PRESCENE_RETURN_IF_ERROR(check_finite_positive(inside.size[i], "a volume's edge"));
    return {};
  }
  Status operator()(const RestingOn& resting) const { return check_other(resting.support); }
  Status operator()(const UprightWithin& upright) const {
    PRESCENE_RETURN_IF_ERROR(check_unit(upright.axis_O));
    return check_angle(upright.max_angle);
  }
  Status operator()(const FaceUp& face) const {
    PRESCENE_RETURN_IF_ERROR(check_unit(face.axis_O));
    if (face.axis_O.cwiseAbs().maxCoeff() < 1.0 - 1e-6)
      return invalid_input("a face is one of +-x, +-y, +-z: give such an axis");
    return {};
  }
  Status operator()(const BelowHeight& below) const {
    if (!std::isfinite(below.height)) return invalid_input("the height is not a number: give metres");
    return {};
  }
  Status operator()(const MovedMoreThan& moved) const {
    if (!(moved.distance >= 0.0) || !std::isfinite(moved.distance))
      return invalid_input("the distance is not a number of at least 0: give metres");
    return {};
  }
  Status operator()(const TurnedMoreThan& turned) const { return check_angle(turned.angle); }
  Status operator()(const Touched& touched) const { return check_other(touched.other); }
  Status operator()(const StillMoving&) const { return {}; }
  Status operator()(const JointWithin& within) const {
    const std::optional<int> index = find_joint(scene, within.joint);
    if (!index) return not_found("there is no joint '" + within.joint + "': name one of the scene's joints");
    if (scene.joints[static_cast<std::size_t>(*index)].type != within.type)
      return invalid_input("the joint '" + within.joint + "' is " +
                           (within.type == JointType::kHinge ? "a slider: give 'min' and 'max' in metres"
                                                             : "a hinge: give 'min_deg' and 'max_deg' in degrees"));
    if (std::isnan(within.low) || std::isnan(within.high) || !(within.low < within.high))
      return invalid_input("the interval of the joint's position is empty: give ends in order, or one of them");
    const Joint& joint = scene.joints[static_cast<std::size_t>(*index)];
    if (within.type == JointType::kHinge && std::isinf(joint.low) &&
        ((std::isfinite(within.low) && std::abs(within.low) > kHalfTurn) ||
         (std::isfinite(within.high) && std::abs(within.high) > kHalfTurn)))
      return invalid_input("the joint '" + within.joint +
                           "' has no limits, so its position is between -180 and 180 degrees: give ends within these, "
                           "of an interval across 180 degrees two outcomes or any_of, or give the joint limits");
    if (within.low > joint.high || within.high < joint.low)
      return invalid_input("the joint '" + within.joint + "' never gets there, its limits are " + ends_of(joint) +
                           ": give an interval that meets them");
    return {};
  }

  Status check_other(const std::string& name) const {
    if (name == object)
      return invalid_input("'" + name + "' neither touches itself nor rests on itself: name another thing");
    return check_thing(scene, name);
  }
  static Status check_unit(const Vector3d& axis) {
    if (!axis.allFinite() || std::abs(axis.norm() - 1.0) > 1e-6)
      return invalid_input("the axis is not of length 1: normalise it");
    return {};
  }
  static Status check_angle(double angle) {
    if (!(angle >= 0.0) || !(angle <= 3.2)) return invalid_input("the angle is not between 0 and pi: give radians");
    return {};
  }
};

Status check_unique(const Scene& scene) {
  std::set<std::string> models, things;
  for (const ObjectModel& model : scene.models)
    if (!models.insert(model.name).second)
      return invalid_input("two models are called '" + model.name + "': rename one");
  const auto add = [&](const std::string& name) -> Status {
    if (things.insert(name).second) return {};
    return invalid_input("two of the objects, supports and robot bodies are called '" + name + "': rename one");
  };
  for (const SceneObject& object : scene.objects) PRESCENE_RETURN_IF_ERROR(add(object.name));
  for (const Support& support : scene.supports) PRESCENE_RETURN_IF_ERROR(add(support.name));
  for (const KinematicBody& body : scene.robot) PRESCENE_RETURN_IF_ERROR(add(body.name));
  return {};
}

Status check_support(const Support& support) {
  PRESCENE_RETURN_IF_ERROR(check_name(support.name));
  PRESCENE_RETURN_IF_ERROR(check_shapes(support.collision));
  PRESCENE_RETURN_IF_ERROR(check_pose(support.X_WS));
  PRESCENE_RETURN_IF_ERROR(check_contact(support.contact));
  return check_color(support.color);
}

Status check_robot_body(const KinematicBody& body) {
  PRESCENE_RETURN_IF_ERROR(check_name(body.name));
  PRESCENE_RETURN_IF_ERROR(check_shapes(body.collision));
  PRESCENE_RETURN_IF_ERROR(check_contact(body.contact));
  PRESCENE_RETURN_IF_ERROR(check_color(body.color));
  if (body.timeline.empty()) return invalid_input("its timeline is empty: give at least one pose");
  for (std::size_t i = 0; i < body.timeline.size(); ++i) {
    PRESCENE_RETURN_IF_ERROR(check_pose(body.timeline[i].X_WG).at("timeline"));
    if (!std::isfinite(body.timeline[i].time)) return invalid_input("a time is not a number: give seconds");
    if (i > 0 && !(body.timeline[i].time > body.timeline[i - 1].time))
      return invalid_input("the times of its timeline do not grow: sort them and make them differ");
  }
  return {};
}

Status check_object(const Scene& scene, const SceneObject& object) {
  PRESCENE_RETURN_IF_ERROR(check_name(object.name));
  if (object.model < 0 || object.model >= std::ssize(scene.models))
    return not_found("its model " + std::to_string(object.model) +
                     " is not among the scene's models: name one of them");
  PRESCENE_RETURN_IF_ERROR(check_pose(object.pose).at("pose"));
  PRESCENE_RETURN_IF_ERROR(check_vector(object.twist.angular, kSpeedRange).at("angular velocity"));
  PRESCENE_RETURN_IF_ERROR(check_vector(object.twist.linear, kSpeedRange).at("velocity"));
  if (object.held_by && !find_robot_body(scene, *object.held_by))
    return not_found("there is no robot body '" + *object.held_by +
                     "' to hold it: name one of the scene's robot bodies");
  return {};
}

/// Both of an outcome's conditions at once are impossible: one is the other turned round.
bool contradict(const Condition& a, const Condition& b) {
  return a.predicate == b.predicate && a.when == b.when && a.negated != b.negated;
}

Status check_outcome(const Scene& scene, const Outcome& outcome) {
  if (outcome.name.empty()) return invalid_input("an outcome has no name: name it");
  const std::string place = quoted("outcome", outcome.name);
  PRESCENE_RETURN_IF_ERROR(check_object_name(scene, outcome.object).at(place));
  if (outcome.all_of.empty() && outcome.any_of.empty())
    return invalid_input("it has no condition: give at least one").at(place);
  for (const Condition& condition : all_conditions(outcome))
    PRESCENE_RETURN_IF_ERROR(std::visit(PredicateCheck{scene, outcome.object}, condition.predicate).at(place));
  for (std::size_t i = 0; i < outcome.all_of.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (contradict(outcome.all_of[i], outcome.all_of[j]))
        return invalid_input("a condition and its opposite never hold together: take one of them out").at(place);
  for (std::size_t i = 0; i < outcome.any_of.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (contradict(outcome.any_of[i], outcome.any_of[j]))
        return invalid_input("any_of always holds, as it has a condition and its opposite: take one of them out")
            .at(place);
  return {};
}

Status check_outcomes(const Scene& scene) {
  std::set<std::string> names;
  for (const Outcome& outcome : scene.outcomes) {
    PRESCENE_RETURN_IF_ERROR(check_outcome(scene, outcome));
    if (!names.insert(outcome.name).second)
      return invalid_input("two outcomes are called '" + outcome.name + "': rename one");
  }
  std::set<std::string> groups;
  for (const ExclusiveOutcomes& group : scene.exclusive_outcomes) {
    const std::string place = quoted("exclusive outcomes", group.name);
    if (!groups.insert(group.name).second) return invalid_input("two groups have this name: rename one").at(place);
    if (group.outcomes.empty()) return invalid_input("the group is empty: give at least one outcome").at(place);
    std::set<std::string> members{"other"};
    for (const Outcome& outcome : group.outcomes) {
      PRESCENE_RETURN_IF_ERROR(check_outcome(scene, outcome).at(place));
      if (!members.insert(outcome.name).second)
        return invalid_input("two outcomes are called '" + outcome.name + "' ('other' is made by itself): rename one")
            .at(place);
    }
    for (std::size_t later = 1; later < group.outcomes.size(); ++later)
      for (std::size_t earlier = 0; earlier < later; ++earlier)
        if (is_implied(group.outcomes[earlier], group.outcomes[later]))
          return invalid_input("'" + group.outcomes[later].name + "' never counts, as '" +
                               group.outcomes[earlier].name +
                               "' above it holds whenever it does: put the narrower outcome first")
              .at(place);
  }
  return {};
}

Status check_cameras(const Scene& scene) {
  if (!scene.camera && !scene.more_cameras.empty()) return invalid_input("cameras: there are more, but no first one");
  if (scene.more_cameras.size() >= kMostCameras)
    return invalid_input("cameras: there are more than " + std::to_string(kMostCameras));
  std::set<std::string> names;
  for (int i = 0; scene.camera && i < camera_count(scene); ++i) {
    const SceneCamera& camera = *camera_at(scene, i);
    const std::string place = scene.more_cameras.empty() ? "camera" : quoted("camera", camera.name);
    if (!names.insert(camera.name).second) return invalid_input("two have this name: rename one").at(place);
    PRESCENE_RETURN_IF_ERROR(geometry::validate(camera.intrinsics).at(place));
    PRESCENE_RETURN_IF_ERROR(check_pose(camera.X_WC).at(place));
    PRESCENE_RETURN_IF_ERROR(check_depth_noise(camera.depth_noise).at("depth_noise").at(place));
  }
  return core::ok_status();
}

}  // namespace

bool is_implied(const Outcome& earlier, const Outcome& later) {
  const auto is_in = [](const std::vector<Condition>& conditions) {
    return [&conditions](const Condition& condition) {
      return std::find(conditions.begin(), conditions.end(), condition) != conditions.end();
    };
  };
  if (earlier.object != later.object || !std::all_of(earlier.all_of.begin(), earlier.all_of.end(), is_in(later.all_of)))
    return false;
  // Whichever of the later one's holds, it is one of the earlier one's.
  return earlier.any_of.empty() || std::any_of(later.all_of.begin(), later.all_of.end(), is_in(earlier.any_of)) ||
         (!later.any_of.empty() && std::all_of(later.any_of.begin(), later.any_of.end(), is_in(earlier.any_of)));
}

Status validate(const Scene& scene) {
  for (const ObjectModel& model : scene.models) PRESCENE_RETURN_IF_ERROR(validate(model));
  PRESCENE_RETURN_IF_ERROR(check_unique(scene));
  for (const Support& support : scene.supports)
    PRESCENE_RETURN_IF_ERROR(check_support(support).at(quoted("support", support.name)));
  for (const KinematicBody& body : scene.robot)
    PRESCENE_RETURN_IF_ERROR(check_robot_body(body).at(quoted("robot body", body.name)));
  for (const SceneObject& object : scene.objects)
    PRESCENE_RETURN_IF_ERROR(check_object(scene, object).at(quoted("object", object.name)));
  PRESCENE_RETURN_IF_ERROR(validate_joints(scene));
  PRESCENE_RETURN_IF_ERROR(check_cameras(scene));
  PRESCENE_RETURN_IF_ERROR(check_depth_noise(scene.depth_noise).at("depth_noise"));
  if (!scene.gravity_W.allFinite()) return invalid_input("gravity is not finite: give m/s^2");
  PRESCENE_RETURN_IF_ERROR(check_finite_positive(scene.duration, "a duration"));
  double last = 0.0;
  for (const Action& action : scene.actions) {
    const std::string place = "action " + kind_of(action);
    if (!(action.time >= last) || !std::isfinite(action.time))
      return invalid_input("its time is before 0 or before that of the action above: sort the actions by time")
          .at(place);
    last = action.time;
    PRESCENE_RETURN_IF_ERROR(std::visit(ActionCheck{scene}, action.what).at(place));
  }
  return check_outcomes(scene);
}

Status validate(const Scene& scene, const Outcome& outcome) { return check_outcome(scene, outcome); }

}  // namespace prescene::belief
