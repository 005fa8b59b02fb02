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
  Json operator()(const Grasp& grasp) const { return {{"object", grasp.object}, {"hand", grasp.hand}}; }
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
  const auto what = object.one_of({"release", "place", "push", "pour", "grasp", "transport"});
  if (!what) return action;
  JsonObject fields(what->second);
  if (what->first == "release") action.what = release_from(fields);
  if (what->first == "place") action.what = move_from<Place>(fields);
  if (what->first == "push") action.what = push_from(fields);
  if (what->first == "pour") action.what = pour_from(fields);
  if (what->first == "transport") action.what = move_from<Transport>(fields);
  if (what->first == "grasp") {
    const std::string object_name = text_of(fields, "object");
    action.what = Grasp{object_name, text_of(fields, "hand")};
  }
  return action;
}

core::Result<Action> action_from_json(const Json& value) {
  JsonErrors errors;
  Action action = action_from({value, "", errors});
  if (!errors.ok()) return errors.status();
  return action;
}

}  // namespace prescene::belief
