// SPDX-License-Identifier: Apache-2.0
// What validate(Scene) checks of outcomes.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <variant>

#include "prescene/belief/scene.h"
#include "prescene/belief/validation.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "scene_checks.h"

namespace prescene::belief {
namespace {

using core::invalid_input;
using core::not_found;
using core::Status;

bool is_thing(const Scene& scene, const std::string& name) {
  return find_object(scene, name) || find_support(scene, name) || find_robot_body(scene, name);
}

Status check_thing(const Scene& scene, const std::string& name) {
  if (!is_thing(scene, name))
    return not_found("there is no '" + name + "': name an object, a support or a robot body of the scene");
  return {};
}

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

}  // namespace

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

Status validate(const Scene& scene, const Outcome& outcome) { return check_outcome(scene, outcome); }

}  // namespace prescene::belief
