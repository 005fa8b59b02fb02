// SPDX-License-Identifier: Apache-2.0
// JSON of questions about what brings an outcome about, and of their answers.
#include "json_achieve.h"

#include "prescene/belief/action_schema.h"
#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/geometry/angles.h"

namespace prescene::belief {
namespace {

/// A vector of three, or one number for all of them.
Vector3d deviations_from(const JsonAt& at, double unit) {
  if (at.value.is_number()) return Vector3d::Constant(unit * at.number());
  return unit * vector_from(at);
}

ActionErrors errors_from(const JsonAt& at) {
  ActionErrors errors;
  JsonObject fields(at);
  if (const auto given = fields.find("position")) errors.position = deviations_from(*given, 1.0);
  if (const auto given = fields.find("rotation_deg")) errors.rotation = deviations_from(*given, geometry::kDegree);
  if (const auto given = fields.find("delay")) errors.delay = scalar_from(*given);
  if (const auto given = fields.find("lateral_error")) errors.lateral_error = scalar_from(*given);
  const auto velocity = fields.find("velocity"), angular_velocity = fields.find("angular_velocity");
  if (velocity || angular_velocity) errors.disturbance.emplace();
  if (velocity) errors.disturbance->linear = vector_distribution_from(*velocity);
  if (angular_velocity) errors.disturbance->angular = vector_distribution_from(*angular_velocity);
  return errors;
}

Json errors_json(const ActionErrors& errors) {
  Json json{{"position", vector_json(errors.position)},
            {"rotation_deg",
             {geometry::exact_degrees(errors.rotation.x()), geometry::exact_degrees(errors.rotation.y()),
              geometry::exact_degrees(errors.rotation.z())}},
            {"delay", scalar_json(errors.delay)},
            {"lateral_error", scalar_json(errors.lateral_error)}};
  if (errors.disturbance) {
    json["velocity"] = vector_distribution_json(errors.disturbance->linear);
    json["angular_velocity"] = vector_distribution_json(errors.disturbance->angular);
  }
  return json;
}

/// ["x", "yaw"], or {"x": [low, high], "yaw": null}.
std::vector<ParameterRange> ranges_from(const JsonAt& at) {
  std::vector<ParameterRange> ranges;
  if (!at.value.is_object()) {
    for (const JsonAt& name : at.items()) ranges.push_back({name.text(), {}, {}});
    return ranges;
  }
  for (const auto& [name, value] : at.value.items()) {
    ParameterRange& range = ranges.emplace_back();
    range.name = name;
    const JsonAt given{value, at.path + "." + printable_key(name), at.errors};
    if (given.value.is_null()) continue;
    const std::vector<double> ends = given.numbers(2);
    range.low = ends[0];
    range.high = ends[1];
  }
  return ranges;
}

/// By the parameters' names.
Json values_json(const std::vector<double>& values, const std::vector<SearchedParameter>& parameters) {
  Json json = Json::object();
  for (std::size_t i = 0; i < values.size() && i < parameters.size(); ++i) json[parameters[i].name] = values[i];
  return json;
}

Json choice_json(const ActionChoice& choice, const std::vector<SearchedParameter>& parameters) {
  const auto named = [&](const std::vector<double>& values) { return values_json(values, parameters); };
  Json json{{"values", named(choice.values)}};
  if (!choice.low.empty()) {
    json["low"] = named(choice.low);
    json["high"] = named(choice.high);
  }
  if (choice.X_WO) json["pose"] = to_json(*choice.X_WO);
  if (choice.action) json["action"] = to_json(*choice.action);
  json["probability"] = choice.probability;
  json["interval"] = {choice.lower, choice.upper};
  json["instances"] = choice.instances;
  json["certified"] = choice.certified;
  return json;
}

}  // namespace

AchieveQuery achieve_from(JsonObject& fields) {
  AchieveQuery achieve;
  if (const auto at = fields.require("outcome")) {
    if (at->value.is_object()) {
      // The name may be left out: there is only this one.
      Json named = at->value;
      if (!named.contains("name")) named["name"] = "wanted";
      const Json list = Json::array({std::move(named)});
      const std::vector<Outcome> outcomes = outcomes_from({list, at->path, at->errors}, "");
      if (!outcomes.empty()) achieve.wanted = outcomes.front();
    } else {
      achieve.outcome = at->text();
    }
  }
  if (const auto at = fields.find("action")) achieve.action = at->text();
  if (const auto at = fields.find("object")) achieve.object = at->text();
  if (const auto at = fields.find("support")) achieve.support = at->text();
  if (const auto at = fields.require("free")) achieve.free = ranges_from(*at);
  if (const auto at = fields.find("fixed")) {
    if (!at->value.is_object()) at->fail("an object with a number for each parameter is needed");
    if (at->value.is_object())
      for (const auto& [name, value] : at->value.items())
        achieve.fixed.push_back({name, JsonAt{value, at->path + "." + printable_key(name), at->errors}.number()});
  }
  if (const auto at = fields.find("errors")) achieve.errors = errors_from(*at);
  if (const auto at = fields.find("probability")) achieve.probability = at->number();
  if (const auto at = fields.find("survey")) achieve.survey = at->boolean();
  return achieve;
}

Json achieve_json(const AchieveQuery& achieve) {
  Json json = Json::object();
  json["outcome"] = achieve.wanted ? to_json(*achieve.wanted) : Json(achieve.outcome);
  json["action"] = achieve.action;
  if (!achieve.object.empty()) json["object"] = achieve.object;
  if (!achieve.support.empty()) json["support"] = achieve.support;
  Json free = Json::object(), fixed = Json::object();
  for (const ParameterRange& range : achieve.free) {
    free[range.name] = nullptr;
    if (range.low && range.high) free[range.name] = {*range.low, *range.high};
  }
  for (const ParameterValue& value : achieve.fixed) fixed[value.name] = value.value;
  json["free"] = std::move(free);
  json["fixed"] = std::move(fixed);
  json["errors"] = errors_json(achieve.errors);
  json["probability"] = achieve.probability;
  json["survey"] = achieve.survey;
  return json;
}

Json achieve_answer_json(const AchieveAnswer& answer) {
  Json parameters = Json::array();
  for (const SearchedParameter& parameter : answer.parameters)
    parameters.push_back({{"name", parameter.name},
                          {"unit", parameter.unit},
                          {"range", {parameter.low, parameter.high}},
                          {"fails_alone", parameter.fails_alone},
                          {"profile", parameter.profile}});
  Json choices = Json::array();
  for (const ActionChoice& choice : answer.choices) choices.push_back(choice_json(choice, answer.parameters));
  Json candidates = Json::array();
  for (const ActionCandidate& candidate : answer.candidates) {
    Json& json = candidates.emplace_back(Json{{"values", values_json(candidate.values, answer.parameters)}});
    if (candidate.X_WO) json["pose"] = to_json(*candidate.X_WO);
    json["expected"] = candidate.expected;
    json["instances"] = candidate.instances;
  }
  Json failures = Json::array();
  for (const FailureReason& reason : answer.failures)
    failures.push_back({{"what", reason.what}, {"event", reason.event}, {"share", reason.share}});
  Json json{{"outcome", answer.outcome},
            {"action", answer.action},
            {"object", answer.object},
            {"support", answer.support},
            {"wanted", answer.wanted},
            {"confidence", answer.confidence},
            {"found", answer.found},
            {"best", choice_json(answer.best, answer.parameters)},
            {"robust", answer.robust ? choice_json(*answer.robust, answer.parameters) : Json(nullptr)},
            {"choices", std::move(choices)},
            {"candidates", std::move(candidates)},
            {"parameters", std::move(parameters)}};
  if (answer.map)
    json["map"] = {{"x", answer.map->x},         {"y", answer.map->y},
                   {"nx", answer.map->nx},       {"ny", answer.map->ny},
                   {"share", answer.map->share}, {"instances_per_cell", answer.map->instances_per_cell}};
  json["failures"] = std::move(failures);
  json["anywhere"] = outcome_probability_json(answer.anywhere);
  json["impossible"] = answer.impossible;
  json["search_instances"] = answer.search_instances;
  json["attempts"] = answer.attempts;
  json["first_certified"] = {{"instances", answer.first_certified_instances},
                             {"simulated_seconds", answer.first_certified_simulated},
                             {"wall_seconds", answer.first_certified_seconds}};
  add_basis(answer, json);
  return json;
}

}  // namespace prescene::belief
