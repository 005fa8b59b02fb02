// SPDX-License-Identifier: Apache-2.0
// JSON of outcomes, both ways, with the keys of scene files.
#include <cmath>

#include "json_values.h"
#include "prescene/belief/json.h"
#include "prescene/geometry/angles.h"

namespace prescene::belief {
namespace {

// In the order of the variant.
const std::vector<std::string> kConditions{"inside",          "resting_on",           "upright", "face_up", "below",
                                           "moved_more_than", "turned_more_than_deg", "touched", "moving",  "joint"};
static_assert(std::variant_size_v<Predicate> == 10);

struct PredicateJson {
  Json operator()(const InsideVolume& inside) const {
    if (!inside.hollow_of.empty()) return {{"hollow_of", inside.hollow_of}, {"whole", inside.whole}};
    Json json = to_json(inside.X_WV);
    json["size"] = vector_json(inside.size);
    json["whole"] = inside.whole;
    return json;
  }
  Json operator()(const RestingOn& resting) const { return resting.support; }
  Json operator()(const UprightWithin& upright) const {
    return {{"within_deg", geometry::exact_degrees(upright.max_angle)}, {"axis", axis_json(upright.axis_O)}};
  }
  Json operator()(const FaceUp& face) const { return axis_json(face.axis_O); }
  Json operator()(const BelowHeight& below) const { return below.height; }
  Json operator()(const MovedMoreThan& moved) const { return moved.distance; }
  Json operator()(const TurnedMoreThan& turned) const { return geometry::exact_degrees(turned.angle); }
  Json operator()(const Touched& touched) const { return touched.other; }
  Json operator()(const StillMoving&) const { return true; }
  Json operator()(const JointWithin& within) const {
    const bool hinge = within.type == JointType::kHinge;
    const auto number = [&](double end) { return hinge ? geometry::exact_degrees(end) : end; };
    Json json{{"name", within.joint}};
    if (std::isfinite(within.low)) json[hinge ? "min_deg" : "min"] = number(within.low);
    if (std::isfinite(within.high)) json[hinge ? "max_deg" : "max"] = number(within.high);
    return json;
  }
};

InsideVolume inside_from(const JsonAt& at) {
  InsideVolume inside{Pose{}, Vector3d::Zero(), false, ""};
  if (at.value.is_string()) {
    inside.hollow_of = at.text();
    return inside;
  }
  JsonObject fields(at);
  if (const auto whole = fields.find("whole")) inside.whole = whole->boolean();
  if (const auto hollow = fields.find("hollow_of")) {
    inside.hollow_of = hollow->text();
    return inside;
  }
  read_pose(fields, inside.X_WV);
  if (const auto size = fields.find("size"))
    inside.size = vector_from(*size);
  else
    at.fail("give the edges \"size\": [x, y, z] of the box, or \"hollow_of\" a support");
  return inside;
}

UprightWithin upright_from(const JsonAt& at) {
  UprightWithin upright;
  JsonObject fields(at);
  if (const auto angle = fields.require("within_deg")) upright.max_angle = geometry::kDegree * angle->number();
  if (const auto axis = fields.find("axis")) upright.axis_O = axis_from(*axis);
  return upright;
}

JointWithin joint_from(const JsonAt& at) {
  JointWithin within;
  JsonObject fields(at);
  if (const auto name = fields.require("name")) within.joint = name->text();
  bool meters = false;
  const auto end = [&](const char* key, double factor, double& to) {
    const auto number = fields.find(key);
    if (!number) return false;
    to = factor * number->number();
    return true;
  };
  meters = end("min", 1.0, within.low) || meters;
  meters = end("max", 1.0, within.high) || meters;
  bool degrees = end("min_deg", geometry::kDegree, within.low);
  degrees = end("max_deg", geometry::kDegree, within.high) || degrees;
  within.type = degrees ? JointType::kHinge : JointType::kSlider;
  if (meters == degrees)
    at.fail("give \"min\" or \"max\" in metres for a slider, \"min_deg\" or \"max_deg\" for a hinge");
  return within;
}

Condition condition_from(const std::string& key, const JsonAt& at) {
  if (key == "inside") return {inside_from(at)};
  if (key == "resting_on") return {RestingOn{at.text()}};
  if (key == "upright") return {upright_from(at)};
  if (key == "face_up") return {FaceUp{axis_from(at)}};
  if (key == "below") return {BelowHeight{at.number()}};
  if (key == "moved_more_than") return {MovedMoreThan{at.number()}};
  if (key == "turned_more_than_deg") return {TurnedMoreThan{geometry::kDegree * at.number()}};
  if (key == "touched") return {Touched{at.text()}};
  if (key == "joint") return {joint_from(at)};
  return {StillMoving{}, When::kAtEnd, !at.boolean()};
}

std::vector<Condition> conditions_from(JsonObject& fields);

/// Of a map that has no other keys; a mistyped one is reported before the caller can miss the condition.
std::vector<Condition> conditions_of(const JsonAt& at) {
  JsonObject fields(at);
  return conditions_from(fields);
}

/// Of a list of maps of conditions.
std::vector<Condition> listed_conditions(const JsonAt& at) {
  std::vector<Condition> conditions;
  for (const JsonAt& item : at.items()) {
    const std::vector<Condition> read = conditions_of(item);
    if (read.empty()) item.fail("the condition is empty");
    conditions.insert(conditions.end(), read.begin(), read.end());
  }
  if (conditions.empty()) at.fail("at least one condition is needed");
  return conditions;
}

/// All conditions among the keys of a map, each of which has to hold.
std::vector<Condition> conditions_from(JsonObject& fields) {
  std::vector<Condition> conditions;
  When when = When::kAtEnd;
  if (const auto at = fields.find("when")) when = at->word(when_words());
  for (const std::string& key : kConditions) {
    const auto at = fields.find(key);
    if (!at) continue;
    conditions.push_back(condition_from(key, *at));
    conditions.back().when = when;
    if (key == "touched" && when == When::kAlways) at->fail("it is about any time, not 'always': remove 'when'");
  }
  const auto negated = fields.find("not");
  if (!negated) return conditions;
  std::vector<Condition> none;  // of these may hold
  if (negated->value.is_array()) {
    none = listed_conditions(*negated);
  } else {
    none = conditions_of(*negated);
    if (none.size() != 1) negated->fail("one condition is needed, or a list of which none may hold");
  }
  for (Condition& condition : none) {
    condition.negated = !condition.negated;
    conditions.push_back(std::move(condition));
  }
  return conditions;
}

Json condition_json(const Condition& condition) {
  Json json{{kConditions[condition.predicate.index()], std::visit(PredicateJson{}, condition.predicate)},
            {"when", word_of(when_words(), condition.when)}};
  if (condition.negated) return {{"not", std::move(json)}};
  return json;
}

/// `name` from the key of a map; else the outcome gives it. `object` is the group's, "" = none: that of a scene of one
/// object.
Outcome outcome_fields(const JsonAt& at, const std::string* name, const std::string& object) {
  Outcome outcome;
  JsonObject fields(at);
  if (name)
    outcome.name = *name;
  else if (const auto given = fields.require("name"))
    outcome.name = given->text();
  const auto judged = fields.find("object");
  outcome.object = judged ? judged->text() : object;
  outcome.all_of = conditions_from(fields);
  if (const auto list = fields.find("all_of")) {
    const std::vector<Condition> more = listed_conditions(*list);
    outcome.all_of.insert(outcome.all_of.end(), more.begin(), more.end());
  }
  if (const auto list = fields.find("any_of")) {
    for (const JsonAt& item : list->items()) {
      const std::vector<Condition> read = conditions_of(item);
      if (read.size() != 1) item.fail("one condition is needed: of any_of each stands by itself");
      outcome.any_of.insert(outcome.any_of.end(), read.begin(), read.end());
    }
    if (outcome.any_of.empty()) list->fail("at least one condition is needed");
  }
  return outcome;
}

Outcome outcome_from(const JsonAt& at, const std::string* name, const std::string& object) {
  Outcome outcome = outcome_fields(at, name, object);
  // After unknown keys were reported: a mistyped condition explains it.
  if (outcome.all_of.empty() && outcome.any_of.empty())
    at.fail(
        "the outcome has no condition: give inside, resting_on, upright, face_up, below, moved_more_than, "
        "turned_more_than_deg, touched, moving, not, or all_of or any_of with a list of them");
  return outcome;
}

/// Reads each item of a list, or of a map from names.
template <class Read>
void each_named(const JsonAt& at, const Read& read) {
  if (!at.value.is_object()) {
    for (const JsonAt& item : at.items()) read(item, nullptr);
    return;
  }
  for (const auto& [name, value] : at.value.items())
    read(JsonAt{value, at.path + "." + printable_key(name), at.errors}, &name);
}

ExclusiveOutcomes group_from(const JsonAt& at, const std::string* name) {
  ExclusiveOutcomes group;
  JsonObject fields(at);
  if (name)
    group.name = *name;
  else if (const auto given = fields.require("name"))
    group.name = given->text();
  std::string object;
  if (const auto judged = fields.find("object")) object = judged->text();
  const auto form = fields.one_of({"outcomes", "face_up"});
  if (!form) return group;
  if (form->first == "face_up") {
    if (!form->second.boolean()) form->second.fail("it says nothing: write true, or give 'outcomes'");
    return which_face_up(group.name, object);
  }
  group.outcomes = outcomes_from(form->second, object);
  if (group.outcomes.empty()) form->second.fail("at least one outcome is needed");
  return group;
}

}  // namespace

std::vector<Outcome> outcomes_from(const JsonAt& at, const std::string& object) {
  std::vector<Outcome> outcomes;
  each_named(
      at, [&](const JsonAt& item, const std::string* name) { outcomes.push_back(outcome_from(item, name, object)); });
  return outcomes;
}

std::vector<ExclusiveOutcomes> groups_from(const JsonAt& at) {
  std::vector<ExclusiveOutcomes> groups;
  each_named(at, [&](const JsonAt& item, const std::string* name) { groups.push_back(group_from(item, name)); });
  return groups;
}

Json to_json(const Outcome& outcome) {
  Json conditions = Json::array();
  for (const Condition& condition : outcome.all_of) conditions.push_back(condition_json(condition));
  Json json{{"name", outcome.name}, {"object", outcome.object}};
  if (!conditions.empty() || outcome.any_of.empty()) json["all_of"] = std::move(conditions);
  for (const Condition& condition : outcome.any_of) json["any_of"].push_back(condition_json(condition));
  return json;
}

core::Result<Outcome> outcome_from_json(const Json& value) {
  JsonErrors errors;
  Outcome outcome = outcome_from({value, "", errors}, nullptr, "");
  if (!errors.ok()) return errors.status();
  return outcome;
}

Json exclusive_json(const ExclusiveOutcomes& group) {
  Json outcomes = Json::array();
  for (const Outcome& outcome : group.outcomes) outcomes.push_back(to_json(outcome));
  return {{"name", group.name}, {"outcomes", std::move(outcomes)}};
}

}  // namespace prescene::belief
