// SPDX-License-Identifier: Apache-2.0
// JSON of actions, both ways, with the keys of scene files.
#include "json_values.h"
#include "prescene/belief/json.h"
#include "prescene/geometry/angles.h"

namespace prescene::belief {
namespace {

struct ActionJson {
  Json operator()(const Release& release) const {
    return {{"object", release.object},
            {"retreat", vector_json(release.retreat)},
            {"retreat_duration", release.retreat_duration},
            {"velocity", vector_distribution_json(release.disturbance.linear)},
            {"angular_velocity", vector_distribution_json(release.disturbance.angular)}};
  }
  Json operator()(const Place& place) const { return move(place); }
  Json operator()(const Transport& transport) const { return move(transport); }
  Json operator()(const Push& push) const {
    return {{"from", vector_json(push.from)},
            {"to", vector_json(push.to)},
            {"duration", push.duration},
            {"radius", push.radius},
            {"lateral_error", scalar_json(push.lateral_error)}};
  }
  Json operator()(const Pour& pour) const {
    return {{"container", pour.container},
            {"axis", axis_json(pour.axis_W)},
            {"angle_deg", geometry::exact_degrees(pour.angle)},
            {"duration", pour.duration}};
  }
  Json operator()(const Grasp& grasp) const {
    Json json = {{"object", grasp.object}, {"hand", grasp.hand}};
    if (!grasp.grip) return json;
    json["grip_force"] = scalar_json(grasp.grip->force);
    if (grasp.grip->friction) json["finger_friction"] = scalar_json(*grasp.grip->friction);
    json["pad_length"] = grasp.grip->pad_length;
    return json;
  }
  Json operator()(const Bump& bump) const {
    Json json = {{"object", bump.object}, {"impulse", vector_distribution_json(bump.impulse)}};
    if (bump.point_O) json["point"] = vector_json(*bump.point_O);
    return json;
  }
  Json operator()(const Tilt& tilt) const {
    return {{"object", tilt.object},
            {"axis", axis_json(tilt.axis_W)},
            {"angle_deg", geometry::exact_degrees(tilt.angle)},
            {"pivot", vector_json(tilt.pivot_O)},
            {"duration", tilt.duration}};
  }
  Json operator()(const Pull& pull) const {
    Json json = {{"object", pull.object},
                 {"by", vector_json(pull.by)},
                 {"duration", pull.duration},
                 {"force", scalar_json(pull.force)}};
    if (pull.point_O) json["point"] = vector_json(*pull.point_O);
    return json;
  }
  Json operator()(const MoveJoint& move) const {
    Json json = {{"joint", move.joint}};
    if (move.type == JointType::kHinge)
      json["to_deg"] = geometry::exact_degrees(move.to);
    else
      json["to"] = move.to;
    json["duration"] = move.duration;
    json["force"] = scalar_json(move.force);
    if (move.handle_C) json["handle"] = vector_json(*move.handle_C);
    return json;
  }
  Json operator()(const Insert& insert) const {
    return {
        {"object", insert.object},     {"axis", axis_json(insert.axis_W)},   {"distance", insert.distance},
        {"duration", insert.duration}, {"force", scalar_json(insert.force)}, {"torque", scalar_json(insert.torque)}};
  }
  template <class Move>
  static Json move(const Move& of) {
    return {{"object", of.object}, {"pose", pose_distribution_json(of.X_WO)}, {"duration", of.duration}};
  }
};

std::string text_of(JsonObject& fields, const std::string& key) {
  const auto at = fields.require(key);
  return at ? at->text() : std::string();
}

void read_number(JsonObject& fields, const std::string& key, double& to) {
  if (const auto at = fields.find(key)) to = at->number();
}

Release release_from(JsonObject& fields) {
  Release release;
  release.object = text_of(fields, "object");
  if (const auto at = fields.find("retreat")) release.retreat = vector_from(*at);
  read_number(fields, "retreat_duration", release.retreat_duration);
  if (const auto at = fields.find("velocity")) release.disturbance.linear = vector_distribution_from(*at);
  if (const auto at = fields.find("angular_velocity")) release.disturbance.angular = vector_distribution_from(*at);
  return release;
}

Push push_from(JsonObject& fields) {
  Push push;
  if (const auto at = fields.require("from")) push.from = vector_from(*at);
  if (const auto at = fields.require("to")) push.to = vector_from(*at);
  read_number(fields, "duration", push.duration);
  read_number(fields, "radius", push.radius);
  if (const auto at = fields.find("lateral_error")) push.lateral_error = scalar_from(*at);
  return push;
}

Pour pour_from(JsonObject& fields) {
  Pour pour;
  pour.container = text_of(fields, "container");
  if (const auto at = fields.find("axis")) pour.axis_W = axis_from(*at);
  if (const auto at = fields.require("angle_deg")) pour.angle = geometry::kDegree * at->number();
  read_number(fields, "duration", pour.duration);
  return pour;
}

Grasp grasp_from(const JsonAt& whole, JsonObject& fields) {
  Grasp grasp;
  grasp.object = text_of(fields, "object");
  grasp.hand = text_of(fields, "hand");
  const auto force = fields.find("grip_force");
  const auto friction = fields.find("finger_friction");
  const auto length = fields.find("pad_length");
  if (!force && (friction || length)) whole.fail("finger_friction and pad_length are of a grip: give grip_force, too");
  if (!force) return grasp;
  Grip& grip = grasp.grip.emplace();
  grip.force = scalar_from(*force);
  if (friction) grip.friction = scalar_from(*friction);
  if (length) grip.pad_length = length->number();
  return grasp;
}

Bump bump_from(JsonObject& fields) {
  Bump bump;
  bump.object = text_of(fields, "object");
  if (const auto at = fields.require("impulse")) bump.impulse = vector_distribution_from(*at);
  if (const auto at = fields.find("point")) bump.point_O = vector_from(*at);
  return bump;
}

Tilt tilt_from(JsonObject& fields) {
  Tilt tilt;
  tilt.object = text_of(fields, "object");
  if (const auto at = fields.find("axis")) tilt.axis_W = axis_from(*at);
  if (const auto at = fields.require("angle_deg")) tilt.angle = geometry::kDegree * at->number();
  if (const auto at = fields.find("pivot")) tilt.pivot_O = vector_from(*at);
  read_number(fields, "duration", tilt.duration);
  return tilt;
}

Pull pull_from(JsonObject& fields) {
  Pull pull;
  pull.object = text_of(fields, "object");
  if (const auto at = fields.require("by")) pull.by = vector_from(*at);
  read_number(fields, "duration", pull.duration);
  if (const auto at = fields.find("force")) pull.force = scalar_from(*at);
  if (const auto at = fields.find("point")) pull.point_O = vector_from(*at);
  return pull;
}

MoveJoint move_joint_from(JsonObject& fields) {
  MoveJoint move;
  move.joint = text_of(fields, "joint");
  if (const auto to = fields.one_of({"to", "to_deg"})) {
    move.type = to->first == "to" ? JointType::kSlider : JointType::kHinge;
    move.to = (to->first == "to" ? 1.0 : geometry::kDegree) * to->second.number();
  }
  read_number(fields, "duration", move.duration);
  if (const auto at = fields.find("force")) move.force = scalar_from(*at);
  if (const auto at = fields.find("handle")) move.handle_C = vector_from(*at);
  return move;
}

Insert insert_from(JsonObject& fields) {
  Insert insert;
  insert.object = text_of(fields, "object");
  if (const auto at = fields.find("axis")) insert.axis_W = axis_from(*at);
  if (const auto at = fields.require("distance")) insert.distance = at->number();
  read_number(fields, "duration", insert.duration);
  if (const auto at = fields.find("force")) insert.force = scalar_from(*at);
  if (const auto at = fields.find("torque")) insert.torque = scalar_from(*at);
  return insert;
}

template <class Move>
Move move_from(JsonObject& fields) {
  Move move;
  move.object = text_of(fields, "object");
  if (const auto at = fields.require("pose")) move.X_WO = pose_distribution_from(*at);
  read_number(fields, "duration", move.duration);
  return move;
}

}  // namespace

Json to_json(const Action& action) {
  return {{"time", action.time}, {kind_of(action), std::visit(ActionJson{}, action.what)}};
}

Action action_from(const JsonAt& at) {
  Action action;
  JsonObject object(at);
  if (const auto time = object.find("time")) action.time = time->number();
  const auto what = object.one_of(
      {"release", "place", "push", "pour", "grasp", "transport", "bump", "tilt", "pull", "move_joint", "insert"});
  if (!what) return action;
  JsonObject fields(what->second);
  if (what->first == "release") action.what = release_from(fields);
  if (what->first == "place") action.what = move_from<Place>(fields);
  if (what->first == "push") action.what = push_from(fields);
  if (what->first == "pour") action.what = pour_from(fields);
  if (what->first == "transport") action.what = move_from<Transport>(fields);
  if (what->first == "grasp") action.what = grasp_from(what->second, fields);
  if (what->first == "bump") action.what = bump_from(fields);
  if (what->first == "tilt") action.what = tilt_from(fields);
  if (what->first == "pull") action.what = pull_from(fields);
  if (what->first == "move_joint") action.what = move_joint_from(fields);
  if (what->first == "insert") action.what = insert_from(fields);
  return action;
}

core::Result<Action> action_from_json(const Json& value) {
  JsonErrors errors;
  Action action = action_from({value, "", errors});
  if (!errors.ok()) return errors.status();
  return action;
}

}  // namespace prescene::belief
