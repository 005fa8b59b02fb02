// SPDX-License-Identifier: Apache-2.0
// JSON of actions and outcomes, both ways.
#include "json_values.h"
#include "prescene/belief/json.h"

namespace prescene::belief {
namespace {

struct ActionJson {
  Json operator()(const Release& release) const {
    return {{"object", release.object},
            {"retreat", vector_json(release.retreat)},
            {"retreat_duration", release.retreat_duration},
            {"disturbance", twist_distribution_json(release.disturbance)}};
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
            {"axis_W", vector_json(pour.axis_W)},
            {"angle", pour.angle},
            {"duration", pour.duration}};
  }
  Json operator()(const Grasp& grasp) const { return {{"object", grasp.object}, {"hand", grasp.hand}}; }
  template <class Move>
  static Json move(const Move& of) {
    return {{"object", of.object}, {"X_WO", pose_distribution_json(of.X_WO)}, {"duration", of.duration}};
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
  if (const auto at = fields.find("disturbance")) release.disturbance = twist_distribution_from(*at);
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
  if (const auto at = fields.find("axis_W")) pour.axis_W = vector_from(*at);
  if (const auto at = fields.require("angle")) pour.angle = at->number();
  read_number(fields, "duration", pour.duration);
  return pour;
}

template <class Move>
Move move_from(JsonObject& fields) {
  Move move;
  move.object = text_of(fields, "object");
  if (const auto at = fields.require("X_WO")) move.X_WO = pose_distribution_from(*at);
  read_number(fields, "duration", move.duration);
  return move;
}

struct PredicateJson {
  Json operator()(const InsideVolume& inside) const {
    return {{"X_WV", to_json(inside.X_WV)}, {"size", vector_json(inside.size)}, {"whole", inside.whole}};
  }
  Json operator()(const RestingOn& resting) const { return {{"support", resting.support}}; }
  Json operator()(const UprightWithin& upright) const {
    return {{"axis_O", vector_json(upright.axis_O)}, {"max_angle", upright.max_angle}};
  }
  Json operator()(const FaceUp& face) const { return {{"axis_O", vector_json(face.axis_O)}}; }
  Json operator()(const BelowHeight& below) const { return {{"height", below.height}}; }
  Json operator()(const MovedMoreThan& moved) const { return {{"distance", moved.distance}}; }
  Json operator()(const TurnedMoreThan& turned) const { return {{"angle", turned.angle}}; }
  Json operator()(const Touched& touched) const { return {{"other", touched.other}}; }
  Json operator()(const StillMoving&) const { return Json::object(); }
};

// In the order of the variant.
const std::vector<std::string> kPredicates{"inside_volume",    "resting_on",   "upright_within",
                                           "face_up",          "below_height", "moved_more_than",
                                           "turned_more_than", "touched",      "still_moving"};
static_assert(std::variant_size_v<Predicate> == 9);

double required_number(JsonObject& fields, const std::string& key) {
  const auto at = fields.require(key);
  return at ? at->number() : 0.0;
}

// Directions are made unit vectors; those that are already keep their bits.
Vector3d direction_from(const JsonAt& at) {
  const Vector3d direction = vector_from(at);
  const double length = direction.norm();
  if (!(length > 1e-9)) {
    at.fail("a direction of some length is needed");
    return Vector3d::UnitZ();
  }
  return std::abs(length - 1.0) < 1e-9 ? direction : Vector3d(direction / length);
}

Predicate predicate_from(const std::string& kind, const JsonAt& at) {
  JsonObject fields(at);
  if (kind == "inside_volume") {
    InsideVolume inside{Pose{}, Vector3d::Zero()};
    if (const auto pose = fields.require("X_WV")) inside.X_WV = pose_from(*pose);
    if (const auto size = fields.require("size")) inside.size = vector_from(*size);
    if (const auto whole = fields.find("whole")) inside.whole = whole->boolean();
    return inside;
  }
  if (kind == "resting_on") return RestingOn{text_of(fields, "support")};
  if (kind == "upright_within") {
    UprightWithin upright;
    if (const auto axis = fields.find("axis_O")) upright.axis_O = direction_from(*axis);
    read_number(fields, "max_angle", upright.max_angle);
    return upright;
  }
  if (kind == "face_up") {
    FaceUp face;
    if (const auto axis = fields.require("axis_O")) face.axis_O = direction_from(*axis);
    return face;
  }
  if (kind == "below_height") return BelowHeight{required_number(fields, "height")};
  if (kind == "moved_more_than") return MovedMoreThan{required_number(fields, "distance")};
  if (kind == "turned_more_than") return TurnedMoreThan{required_number(fields, "angle")};
  if (kind == "touched") return Touched{text_of(fields, "other")};
  return StillMoving{};
}

Json condition_json(const Condition& condition) {
  return {{kPredicates[condition.predicate.index()], std::visit(PredicateJson{}, condition.predicate)},
          {"when", word_of(when_words(), condition.when)},
          {"negated", condition.negated}};
}

Condition condition_from(const JsonAt& at) {
  Condition condition;
  JsonObject object(at);
  if (const auto predicate = object.one_of(kPredicates))
    condition.predicate = predicate_from(predicate->first, predicate->second);
  if (const auto when = object.find("when")) condition.when = when->word(when_words());
  if (const auto negated = object.find("negated")) condition.negated = negated->boolean();
  return condition;
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

Json to_json(const Outcome& outcome) {
  Json conditions = Json::array();
  for (const Condition& condition : outcome.all_of) conditions.push_back(condition_json(condition));
  return {{"name", outcome.name}, {"object", outcome.object}, {"all_of", std::move(conditions)}};
}

Outcome outcome_from(const JsonAt& at) {
  Outcome outcome;
  JsonObject object(at);
  outcome.name = text_of(object, "name");
  outcome.object = text_of(object, "object");
  if (const auto conditions = object.require("all_of")) {
    for (const JsonAt& item : conditions->items()) outcome.all_of.push_back(condition_from(item));
    if (outcome.all_of.empty()) conditions->fail("at least one condition is needed");
  }
  return outcome;
}

core::Result<Outcome> outcome_from_json(const Json& value) {
  JsonErrors errors;
  Outcome outcome = outcome_from({value, "", errors});
  if (!errors.ok()) return errors.status();
  return outcome;
}

Json exclusive_json(const ExclusiveOutcomes& group) {
  Json outcomes = Json::array();
  for (const Outcome& outcome : group.outcomes) outcomes.push_back(to_json(outcome));
  return {{"name", group.name}, {"outcomes", std::move(outcomes)}};
}

ExclusiveOutcomes exclusive_from(const JsonAt& at) {
  ExclusiveOutcomes group;
  JsonObject object(at);
  group.name = text_of(object, "name");
  const auto form = object.one_of({"outcomes", "face_up"});
  if (!form) return group;
  if (form->first == "face_up") return which_face_up(group.name, form->second.text());
  for (const JsonAt& item : form->second.items()) group.outcomes.push_back(outcome_from(item));
  if (group.outcomes.empty()) form->second.fail("at least one outcome is needed");
  return group;
}

}  // namespace prescene::belief
