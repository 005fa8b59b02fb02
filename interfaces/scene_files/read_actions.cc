// SPDX-License-Identifier: Apache-2.0
#include <numbers>
#include <set>

#include "prescene/geometry/angles.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using geometry::Vector3d;

constexpr NumberRange kForce{0.0, 1e6, "give a force in N, at least 0 and at most 1e6"};
constexpr NumberRange kTorque{0.0, 1e6, "give a torque in N m, at least 0 and at most 1e6"};
constexpr NumberRange kImpulse{-1e6, 1e6, "give an impulse in N s, between -1e6 and 1e6"};
constexpr NumberRange kTurnedBy{-360.0, 360.0, "give degrees between -360 and 360", "deg"};

class ActionReader {
 public:
  explicit ActionReader(SceneContext& context) : context_(context), problems_(context.problems) {
    for (const belief::SceneObject& object : context.scene.objects)
      if (object.held_by) held_.insert(object.name);
  }

  belief::Action read(const LocatedValue& value) {
    belief::Action action;
    Binder binder(value, problems_);
    if (const LocatedValue* at = binder.require("time", "give seconds since the start"))
      action.time = read_number(*at, problems_, kTime).value_or(0.0);
    if (action.time < last_time_)
      problems_.add(value.place, value.path, "its time is before that of the action above", "sort the actions by time");
    last_time_ = action.time;
    std::string which;
    const LocatedValue* what = binder.one_of(
        {"release", "place", "push", "pour", "grasp", "transport", "bump", "tilt", "pull", "move_joint", "insert"},
        "give one of release, place, push, pour, grasp, transport, bump, tilt, pull, move_joint, insert", false,
        &which);
    if (!what) return action;
    Binder fields(*what, problems_);
    if (which == "release") action.what = read_release(fields);
    if (which == "place") action.what = read_place(fields);
    if (which == "push") action.what = read_push(fields);
    if (which == "pour") action.what = read_pour(fields);
    if (which == "grasp") action.what = read_grasp(fields);
    if (which == "transport") action.what = read_transport(fields);
    if (which == "bump") action.what = read_bump(fields);
    if (which == "tilt") action.what = read_tilt(fields);
    if (which == "pull") action.what = read_pull(fields);
    if (which == "move_joint") action.what = read_move_joint(fields);
    if (which == "insert") action.what = read_insert(fields);
    return action;
  }

 private:
  std::string any_object(Binder& fields) {
    const LocatedValue* at = fields.require("object", "name one of the scene's objects");
    return at ? context_.read_name(*at, context_.objects, "an object") : std::string();
  }

  std::string object_name(Binder& fields, std::string_view key) {
    const LocatedValue* at = fields.require(key, "name one of the scene's objects");
    std::string name = at ? context_.read_name(*at, context_.objects, "an object") : std::string();
    if (!name.empty() && belief::joint_of(context_.scene, name))
      problems_.add(at->place, at->path, interfaces::quote(name) + " is on a joint, so that no hand can hold it",
                    "push it, pull it, or move its joint (move_joint)");
    return name;
  }

  void force(Binder& fields, belief::ScalarDistribution& force) {
    if (const LocatedValue* at = fields.find("force")) force = read_scalar(*at, problems_, kForce, true);
  }

  void point(Binder& fields, std::string_view key, std::optional<Vector3d>& point) {
    if (const LocatedValue* at = fields.find(key)) point = read_vector(*at, problems_, kPosition);
  }

  double angle(Binder& fields) {
    const LocatedValue* at = fields.require("angle_deg", "give by how many degrees it is turned");
    return at ? geometry::kDegree * read_number(*at, problems_, kTurnedBy).value_or(0.0) : 0.0;
  }

  // The name of an object that is held now.
  std::string held_name(Binder& fields, std::string_view key) {
    std::string name = object_name(fields, key);
    if (!name.empty() && !held_.count(name)) {
      const LocatedValue& at = *fields.find(key);
      problems_.add(at.place, at.path, interfaces::quote(name) + " is not held at that time",
                    "give the object 'held_by', or grasp it before");
    }
    return name;
  }

  Vector3d vector(Binder& fields, std::string_view key, std::string_view remedy) {
    const LocatedValue* at = fields.require(key, remedy);
    return at ? read_vector(*at, problems_, kPosition) : Vector3d(Vector3d::Zero());
  }

  belief::PoseDistribution pose(Binder& fields) {
    const LocatedValue* at = fields.require("pose", "give the object's pose {position, rotation} in the world");
    return at ? read_pose_distribution(*at, problems_) : belief::FixedPose{};
  }

  belief::Release read_release(Binder& fields) {
    belief::Release release;
    release.object = held_name(fields, "object");
    if (const LocatedValue* at = fields.find("retreat")) release.retreat = read_vector(*at, problems_, kPosition);
    fields.read("retreat_duration", release.retreat_duration, kDuration);
    if (const LocatedValue* at = fields.find("velocity"))
      release.disturbance.linear = read_vector_distribution(*at, problems_, kSpeed);
    if (const LocatedValue* at = fields.find("angular_velocity"))
      release.disturbance.angular = read_vector_distribution(*at, problems_, kTurnRate);
    held_.erase(release.object);
    return release;
  }
  belief::Place read_place(Binder& fields) {
    belief::Place place;
    place.object = held_name(fields, "object");
    place.X_WO = pose(fields);
    fields.read("duration", place.duration, kDuration);
    held_.erase(place.object);
    return place;
  }
  belief::Transport read_transport(Binder& fields) {
    belief::Transport transport;
    transport.object = held_name(fields, "object");
    transport.X_WO = pose(fields);
    fields.read("duration", transport.duration, kDuration);
    return transport;
  }
  belief::Push read_push(Binder& fields) {
    belief::Push push;
    push.from = vector(fields, "from", "give where the finger starts [x, y, z]");
    push.to = vector(fields, "to", "give where the finger ends [x, y, z]");
    fields.read("duration", push.duration, kDuration);
    fields.read("radius", push.radius, kObjectSize);
    if (const LocatedValue* at = fields.find("lateral_error"))
      push.lateral_error = read_scalar(*at, problems_, kPosition);
    return push;
  }
  belief::Pour read_pour(Binder& fields) {
    belief::Pour pour;
    pour.container = held_name(fields, "container");
    if (const LocatedValue* at = fields.find("axis")) pour.axis_W = read_axis(*at, problems_);
    pour.angle = angle(fields);
    fields.read("duration", pour.duration, kDuration);
    return pour;
  }
  belief::Grasp read_grasp(Binder& fields) {
    belief::Grasp grasp;
    grasp.object = object_name(fields, "object");
    if (const LocatedValue* at = fields.require("hand", "name one of the scene's robot bodies"))
      grasp.hand = context_.read_name(*at, context_.robot, "a robot body");
    held_.insert(grasp.object);
    const LocatedValue* force = fields.find("grip_force");
    const LocatedValue* friction = fields.find("finger_friction");
    const LocatedValue* length = fields.find("pad_length");
    if (const LocatedValue* other = friction ? friction : length; other && !force)
      problems_.add(other->place, other->path, "it is of a grip that may slip, which is not given",
                    "give 'grip_force', too, or leave it out");
    if (!force) return grasp;
    belief::Grip& grip = grasp.grip.emplace();
    grip.force = read_scalar(*force, problems_, kForce, true);
    if (friction) grip.friction = read_scalar(*friction, problems_, kFriction, true);
    if (length) grip.pad_length = read_number(*length, problems_, kObjectSize).value_or(grip.pad_length);
    return grasp;
  }
  belief::Bump read_bump(Binder& fields) {
    belief::Bump bump;
    bump.object = any_object(fields);
    if (const LocatedValue* at = fields.require("impulse", "give the impulse [x, y, z] in the world, N s"))
      bump.impulse = read_vector_distribution(*at, problems_, kImpulse);
    point(fields, "point", bump.point_O);
    return bump;
  }
  belief::Tilt read_tilt(Binder& fields) {
    belief::Tilt tilt;
    tilt.object = held_name(fields, "object");
    if (const LocatedValue* at = fields.find("axis")) tilt.axis_W = read_axis(*at, problems_);
    tilt.angle = angle(fields);
    if (const LocatedValue* at = fields.find("pivot")) tilt.pivot_O = read_vector(*at, problems_, kPosition);
    fields.read("duration", tilt.duration, kDuration);
    return tilt;
  }
  belief::Pull read_pull(Binder& fields) {
    belief::Pull pull;
    pull.object = any_object(fields);
    pull.by = vector(fields, "by", "give how far the hand moves [x, y, z], m");
    fields.read("duration", pull.duration, kDuration);
    force(fields, pull.force);
    point(fields, "point", pull.point_O);
    return pull;
  }
  void check_reach(const belief::Joint& joint, double to, const LocatedValue& at) {
    constexpr double kRounding = 1e-9;
    if (to < joint.low - kRounding || to > joint.high + kRounding)
      problems_.add(at.place, at.path, interfaces::quote(joint.name) + " does not get there",
                    "give a position within its limits");
  }
  belief::MoveJoint read_move_joint(Binder& fields) {
    belief::MoveJoint move;
    std::vector<std::string> names;
    for (const belief::Joint& joint : context_.scene.joints) names.push_back(joint.name);
    if (const LocatedValue* at = fields.require("joint", "name one of the scene's joints"))
      move.joint = context_.read_name(*at, names, "a joint");
    const auto index = belief::find_joint(context_.scene, move.joint);
    if (index) move.type = context_.scene.joints[static_cast<std::size_t>(*index)].type;
    const bool hinge = move.type == belief::JointType::kHinge;
    if (const LocatedValue* at = hinge ? fields.require("to_deg", "give the position of the hinge in degrees")
                                       : fields.require("to", "give the position of the slider in m")) {
      const std::optional<double> to = read_number(*at, problems_, hinge ? kTurnedBy : kPosition);
      move.to = (hinge ? geometry::kDegree : 1.0) * to.value_or(0.0);
      if (to && index) check_reach(context_.scene.joints[static_cast<std::size_t>(*index)], move.to, *at);
    }
    fields.read("duration", move.duration, kDuration);
    force(fields, move.force);
    point(fields, "handle", move.handle_C);
    return move;
  }
  belief::Insert read_insert(Binder& fields) {
    belief::Insert insert;
    insert.object = held_name(fields, "object");
    if (const LocatedValue* at = fields.find("axis")) insert.axis_W = read_axis(*at, problems_);
    if (const LocatedValue* at = fields.require("distance", "give how far it is moved in, m"))
      insert.distance = read_number(*at, problems_, kObjectSize).value_or(insert.distance);
    fields.read("duration", insert.duration, kDuration);
    force(fields, insert.force);
    if (const LocatedValue* at = fields.find("torque")) insert.torque = read_scalar(*at, problems_, kTorque, true);
    held_.erase(insert.object);
    return insert;
  }

  SceneContext& context_;
  Problems& problems_;
  std::set<std::string> held_;
  double last_time_ = 0.0;
};

}  // namespace

std::vector<belief::Action> read_actions(const LocatedValue& value, SceneContext& context) {
  std::vector<belief::Action> actions;
  if (value.kind != LocatedValue::Kind::kList) {
    report_type(value, context.problems, "give a list of actions, each '- {time: 0.5, release: {...}}'");
    return actions;
  }
  ActionReader reader(context);
  for (const LocatedValue& item : value.items) actions.push_back(reader.read(item));
  return actions;
}

}  // namespace prescene::interfaces
