// SPDX-License-Identifier: Apache-2.0
#include <numbers>
#include <set>

#include "prescene/geometry/angles.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using geometry::Vector3d;

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
    const LocatedValue* what = binder.one_of({"release", "place", "push", "pour", "grasp", "transport"},
                                             "give one of release, place, push, pour, grasp, transport", false, &which);
    if (!what) return action;
    Binder fields(*what, problems_);
    if (which == "release") action.what = read_release(fields);
    if (which == "place") action.what = read_place(fields);
    if (which == "push") action.what = read_push(fields);
    if (which == "pour") action.what = read_pour(fields);
    if (which == "grasp") action.what = read_grasp(fields);
    if (which == "transport") action.what = read_transport(fields);
    return action;
  }

 private:
  std::string object_name(Binder& fields, std::string_view key) {
    const LocatedValue* at = fields.require(key, "name one of the scene's objects");
    std::string name = at ? context_.read_name(*at, context_.objects, "an object") : std::string();
    if (!name.empty() && belief::joint_of(context_.scene, name))
      problems_.add(at->place, at->path, interfaces::quote(name) + " is on a joint, so that no hand can hold it",
                    "push it, or let a robot body pull it");
    return name;
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
    double angle_deg = 0.0;
    if (const LocatedValue* at = fields.require("angle_deg", "give by how many degrees it is turned"))
      angle_deg =
          read_number(*at, problems_, {-360.0, 360.0, "give degrees between -360 and 360", "deg"}).value_or(0.0);
    pour.angle = geometry::kDegree * angle_deg;
    fields.read("duration", pour.duration, kDuration);
    return pour;
  }
  belief::Grasp read_grasp(Binder& fields) {
    belief::Grasp grasp;
    grasp.object = object_name(fields, "object");
    if (const LocatedValue* at = fields.require("hand", "name one of the scene's robot bodies"))
      grasp.hand = context_.read_name(*at, context_.robot, "a robot body");
    held_.insert(grasp.object);
    return grasp;
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
