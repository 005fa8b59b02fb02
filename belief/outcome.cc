// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/outcome.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/belief/body_names.h"
#include "prescene/belief/scene.h"
#include "prescene/belief/trajectory.h"
#include "prescene/core/check.h"
#include "prescene/geometry/mesh_facts.h"

namespace prescene::belief {
namespace {

// The face of the body that points most upwards: 0..5 for +x, -x, +y, -y, +z, -z; ties go to the first.
int upper_face(const Pose& X_WO) {
  const Vector3d up_O = X_WO.rotation.conjugate() * Vector3d::UnitZ();
  int best = 0;
  for (int face = 1; face < 6; ++face) {
    const auto height = [&](int f) { return f % 2 == 0 ? up_O[f / 2] : -up_O[f / 2]; };
    if (height(face) > height(best)) best = face;
  }
  return best;
}

int face_of_axis(const Vector3d& axis_O) {
  Eigen::Index axis = 0;
  axis_O.cwiseAbs().maxCoeff(&axis);
  return static_cast<int>(2 * axis) + (axis_O[axis] < 0.0 ? 1 : 0);
}

bool is_inside(const InsideVolume& volume, const Vector3d& p_WQ) {
  const Vector3d p_VQ = volume.X_WV.inverse() * p_WQ;
  return (p_VQ.cwiseAbs().array() <= 0.5 * volume.size.array()).all();
}

// Judges one condition at one state of one object.
class Judge {
 public:
  Judge(const Scene& scene, const Trajectory& trajectory, std::size_t object)
      : scene_(scene), trajectory_(trajectory), object_(object) {}

  bool operator()(const InsideVolume& volume, const WorldState& state) const {
    const Pose& X_WO = pose(state);
    if (!volume.whole) return is_inside(volume, X_WO.translation);
    const geometry::Box box = bounds();
    for (int corner = 0; corner < 8; ++corner) {
      const auto type = static_cast<geometry::Box::CornerType>(corner);
      if (!is_inside(volume, X_WO * Vector3d(box.corner(type)))) return false;
    }
    return true;
  }
  bool operator()(const RestingOn& resting, const WorldState& state) const {
    const std::optional<int> other = body_index(scene_, resting.support);
    if (!other || is_moving(state.objects[object_])) return false;
    return std::any_of(trajectory_.contacts.begin(), trajectory_.contacts.end(), [&](const ContactInterval& contact) {
      return contact.begin <= state.time && state.time <= contact.end &&
             supports(contact, *other, static_cast<int>(object_));
    });
  }
  bool operator()(const UprightWithin& upright, const WorldState& state) const {
    return angle_between_vectors(pose(state).rotation * upright.axis_O, Vector3d::UnitZ()) <= upright.max_angle;
  }
  bool operator()(const FaceUp& face, const WorldState& state) const {
    return upper_face(pose(state)) == face_of_axis(face.axis_O);
  }
  bool operator()(const BelowHeight& below, const WorldState& state) const {
    return pose(state).translation.z() < below.height;
  }
  bool operator()(const MovedMoreThan& moved, const WorldState& state) const {
    return (pose(state).translation - pose(trajectory_.start()).translation).norm() > moved.distance;
  }
  bool operator()(const TurnedMoreThan& turned, const WorldState& state) const {
    return geometry::angle_between(pose(state).rotation, pose(trajectory_.start()).rotation) > turned.angle;
  }
  bool operator()(const Touched& touched, const WorldState&) const {
    const std::optional<int> other = body_index(scene_, touched.other);
    const auto self = static_cast<int>(object_);
    return other &&
           std::any_of(trajectory_.contacts.begin(), trajectory_.contacts.end(), [&](const ContactInterval& c) {
             return (c.first == self && c.second == *other) || (c.first == *other && c.second == self);
           });
  }
  bool operator()(const StillMoving&, const WorldState& state) const { return is_moving(state.objects[object_]); }
  bool operator()(const JointWithin& within, const WorldState& state) const {
    const std::optional<int> joint = find_joint(scene_, within.joint);
    if (!joint) return false;
    const double position = joint_states(scene_, state)[static_cast<std::size_t>(*joint)].position;
    return within.low <= position && position <= within.high;
  }

 private:
  const Pose& pose(const WorldState& state) const { return state.objects[object_].X_WO; }
  geometry::Box bounds() const {
    const ObjectModel& model = scene_.model_of(scene_.objects[object_]);
    return model.visual ? geometry::facts_of(model.visual).box : geometry::bounding_box(collision_mesh(model));
  }
  static double angle_between_vectors(const Vector3d& a, const Vector3d& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }

  const Scene& scene_;
  const Trajectory& trajectory_;
  std::size_t object_;
};

bool holds_at(const Judge& judge, const Condition& condition, const WorldState& state) {
  return std::visit([&](const auto& predicate) { return judge(predicate, state); }, condition.predicate);
}

bool holds_plain(const Judge& judge, const Condition& condition, const Trajectory& trajectory) {
  const auto at = [&](const WorldState& state) { return holds_at(judge, condition, state); };
  switch (condition.when) {
    case When::kAtEnd:
      return at(trajectory.final());
    case When::kEver:
      return std::any_of(trajectory.states.begin(), trajectory.states.end(), at);
    case When::kAlways:
      return std::all_of(trajectory.states.begin(), trajectory.states.end(), at);
  }
  PRESCENE_CHECK_MSG(false, "a When outside of its enumeration");
}

}  // namespace

ExclusiveOutcomes which_face_up(const std::string& name, const std::string& object) {
  static constexpr std::array kFaces{"+x", "-x", "+y", "-y", "+z", "-z"};
  ExclusiveOutcomes faces{name, {}};
  for (int face = 0; face < 6; ++face) {
    const Vector3d axis_O = (face % 2 == 0 ? 1.0 : -1.0) * Vector3d::Unit(face / 2);
    faces.outcomes.push_back({kFaces[static_cast<std::size_t>(face)], object, {Condition{FaceUp{axis_O}}}});
  }
  return faces;
}

std::vector<Condition> all_conditions(const Outcome& outcome) {
  std::vector<Condition> conditions = outcome.all_of;
  conditions.insert(conditions.end(), outcome.any_of.begin(), outcome.any_of.end());
  return conditions;
}

core::Status complete_outcome(const Scene& scene, Outcome& outcome) {
  if (outcome.object.empty()) {
    for (const Condition& condition : all_conditions(outcome)) {
      const auto* within = std::get_if<JointWithin>(&condition.predicate);
      const std::optional<int> joint = within ? find_joint(scene, within->joint) : std::nullopt;
      if (joint && outcome.object.empty()) outcome.object = scene.joints[static_cast<std::size_t>(*joint)].child;
    }
  }
  if (outcome.object.empty()) {
    if (scene.objects.size() != 1)
      return core::invalid_input(outcome.name + ": the key 'object' is missing: name the object that is judged");
    outcome.object = scene.objects[0].name;
  }
  const auto complete = [&](Condition& condition) -> core::Status {
    auto* inside = std::get_if<InsideVolume>(&condition.predicate);
    if (!inside || inside->hollow_of.empty()) return core::ok_status();
    const std::optional<int> index = find_support(scene, inside->hollow_of);
    if (!index)
      return core::not_found(outcome.name + ": there is no support '" + inside->hollow_of +
                             "': name one of the scene's, or give a box {position, size}");
    const Support& support = scene.supports[static_cast<std::size_t>(*index)];
    if (!support.hollow)
      return core::invalid_input(outcome.name + ": '" + inside->hollow_of +
                                 "' has no hollow: name another support, or give a box {position, size}");
    inside->X_WV = support.X_WS * support.hollow->X_OV;
    inside->size = support.hollow->size;
    inside->hollow_of.clear();
    return core::ok_status();
  };
  for (Condition& condition : outcome.all_of) PRESCENE_RETURN_IF_ERROR(complete(condition));
  for (Condition& condition : outcome.any_of) PRESCENE_RETURN_IF_ERROR(complete(condition));
  return core::ok_status();
}

bool needs_states_along_the_way(const Outcome& outcome) {
  const auto needs = [](const Condition& condition) {
    return condition.when != When::kAtEnd && !std::holds_alternative<Touched>(condition.predicate);
  };
  return std::any_of(outcome.all_of.begin(), outcome.all_of.end(), needs) ||
         std::any_of(outcome.any_of.begin(), outcome.any_of.end(), needs);
}

bool holds(const Scene& scene, const Trajectory& trajectory, const Outcome& outcome) {
  const std::optional<int> object = find_object(scene, outcome.object);
  PRESCENE_CHECK_MSG(object, "an outcome about an object that the scene does not have: " + outcome.object);
  PRESCENE_CHECK(!trajectory.states.empty());
  const Judge judge(scene, trajectory, static_cast<std::size_t>(*object));
  const auto met = [&](const Condition& condition) {
    return holds_plain(judge, condition, trajectory) != condition.negated;
  };
  return std::all_of(outcome.all_of.begin(), outcome.all_of.end(), met) &&
         (outcome.any_of.empty() || std::any_of(outcome.any_of.begin(), outcome.any_of.end(), met));
}

int classify(const Scene& scene, const Trajectory& trajectory, const ExclusiveOutcomes& exclusive) {
  const auto first = std::find_if(exclusive.outcomes.begin(), exclusive.outcomes.end(),
                                  [&](const Outcome& outcome) { return holds(scene, trajectory, outcome); });
  return static_cast<int>(first - exclusive.outcomes.begin());
}

}  // namespace prescene::belief
