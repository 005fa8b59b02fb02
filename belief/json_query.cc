// SPDX-License-Identifier: Apache-2.0
// JSON of queries, both ways, and of answers.
#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <utility>

#include "json_achieve.h"
#include "json_motion.h"
#include "json_relations.h"
#include "json_values.h"
#include "json_view.h"
#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/check.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"

namespace prescene::belief {
namespace {

constexpr std::size_t kLongestQuery = std::size_t{1} << 20;

struct CodeName {
  core::StatusCode code;
  std::string_view name;
};
constexpr CodeName kCodes[] = {
    {core::StatusCode::kInvalidInput, "invalid_input"}, {core::StatusCode::kNotFound, "not_found"},
    {core::StatusCode::kDataLoss, "data_loss"},         {core::StatusCode::kUnsupported, "unsupported"},
    {core::StatusCode::kUnavailable, "unavailable"},    {core::StatusCode::kResourceExhausted, "resource_exhausted"},
    {core::StatusCode::kCancelled, "cancelled"}};

Json effort_json(const Effort& effort) {
  Json json{
      {"tolerance", effort.tolerance}, {"confidence", effort.confidence}, {"max_instances", effort.max_instances}};
  if (effort.max_seconds) json["max_seconds"] = *effort.max_seconds;
  if (effort.exact_instances) json["exact_instances"] = *effort.exact_instances;
  return json;
}

void read_number(JsonObject& fields, const std::string& key, const ScalarRange& range, double& to) {
  if (const std::optional<double> number = read_number(fields, key, range)) to = *number;
}

Effort effort_from(const JsonAt& at, Effort effort = {}) {
  JsonObject fields(at);
  read_number(fields, "tolerance", kTolerances, effort.tolerance);
  read_number(fields, "confidence", kConfidences, effort.confidence);
  if (const auto count = fields.find("max_instances"))
    effort.max_instances = static_cast<int>(count->integer(1, kMostInstances));
  effort.max_seconds = read_number(fields, "max_seconds", kWallSeconds);
  if (const auto count = fields.find("exact_instances"))
    effort.exact_instances = static_cast<int>(count->integer(1, kMostInstances));
  return effort;
}

Json actions_json(const std::vector<Action>& actions) {
  Json json = Json::array();
  for (const Action& action : actions) json.push_back(to_json(action));
  return json;
}

std::vector<Action> actions_from(JsonObject& fields) {
  std::vector<Action> actions;
  if (const auto at = fields.find("actions"))
    for (const JsonAt& item : at->items()) actions.push_back(action_from(item));
  return actions;
}

struct DetailWord {
  const char* word;
  bool PredictDetail::*field;
};
constexpr std::array<DetailWord, 6> kDetailWords{{{"final_poses", &PredictDetail::final_poses},
                                                  {"typical_runs", &PredictDetail::typical_runs},
                                                  {"inputs", &PredictDetail::inputs},
                                                  {"contacts", &PredictDetail::contacts},
                                                  {"chaos", &PredictDetail::chaos},
                                                  {"model_error", &PredictDetail::model_error}}};

Json detail_json(const PredictDetail& detail) {
  Json json = Json::array();
  for (const DetailWord& word : kDetailWords)
    if (detail.*word.field) json.push_back(word.word);
  return json;
}

PredictDetail detail_from(const JsonAt& at) {
  PredictDetail detail;
  for (const DetailWord& word : kDetailWords) detail.*word.field = false;
  for (const JsonAt& item : at.items()) {
    const std::string asked = item.text();
    const auto found = std::find_if(kDetailWords.begin(), kDetailWords.end(),
                                    [&](const DetailWord& word) { return asked == word.word; });
    if (found == kDetailWords.end())
      item.fail("one of final_poses, typical_runs, inputs, contacts, chaos, model_error is needed");
    else
      detail.*found->field = true;
  }
  return detail;
}

Json detail_json(const StabilityDetail& detail) {
  Json json = Json::array();
  if (detail.margin) json.push_back("margin");
  if (detail.removal) json.push_back("removal");
  return json;
}

StabilityDetail stability_detail_from(const JsonAt& at) {
  StabilityDetail detail;
  for (const JsonAt& item : at.items()) {
    const std::string asked = item.text();
    if (asked == "margin")
      detail.margin = true;
    else if (asked == "removal")
      detail.removal = true;
    else
      item.fail("one of margin, removal is needed");
  }
  return detail;
}

struct QueryJson {
  Json operator()(const WhereQuery& where) const {
    Json json = Json::object();
    if (where.object) json["object"] = *where.object;
    return json;
  }
  Json operator()(const PredictQuery& predict) const {
    Json outcomes = Json::array(), groups = Json::array();
    for (const Outcome& outcome : predict.outcomes) outcomes.push_back(to_json(outcome));
    for (const ExclusiveOutcomes& group : predict.exclusive_outcomes) groups.push_back(exclusive_json(group));
    Json json{{"actions", actions_json(predict.actions)},
              {"outcomes", std::move(outcomes)},
              {"exclusive_outcomes", std::move(groups)}};
    if (predict.duration) json["duration"] = *predict.duration;
    json["effort"] = effort_json(predict.effort);
    json["detail"] = detail_json(predict.detail);
    if (predict.detail.paths > 0) json["paths"] = predict.detail.paths;
    return json;
  }
  Json operator()(const StabilityQuery& stability) const {
    return {{"object", stability.object},
            {"max_move", stability.max_move},
            {"max_turn_deg", geometry::exact_degrees(stability.max_turn)},
            {"duration", stability.duration},
            {"effort", effort_json(stability.effort)},
            {"detail", detail_json(stability.detail)}};
  }
  Json operator()(const ViewQuery& view) const {
    Json json{{"actions", actions_json(view.actions)}};
    add_view_question(view, json);
    return json;
  }
  Json operator()(const NextViewQuery& next) const { return next_view_json(next); }
  Json operator()(const AchieveQuery& achieve) const {
    Json json = achieve_json(achieve);
    if (achieve.duration) json["duration"] = *achieve.duration;
    json["effort"] = effort_json(achieve.effort);
    return json;
  }
  Json operator()(const RelationsQuery& relations) const { return relations_json(relations); }
  Json operator()(const TimelineQuery& timeline) const { return timeline_question_json(timeline); }
};

const std::vector<std::string> kTasks{"where",   "predict",   "stability", "view",
                                      "achieve", "relations", "timeline",  "next_view"};

PredictQuery predict_from(JsonObject& fields) {
  PredictQuery predict;
  predict.actions = actions_from(fields);
  if (const auto at = fields.find("outcomes")) predict.outcomes = outcomes_from(*at, "");
  if (const auto at = fields.find("exclusive_outcomes")) predict.exclusive_outcomes = groups_from(*at);
  predict.duration = read_number(fields, "duration", kDurations);
  if (const auto at = fields.find("effort")) predict.effort = effort_from(*at);
  if (const auto at = fields.find("detail")) predict.detail = detail_from(*at);
  if (const auto at = fields.find("paths")) predict.detail.paths = static_cast<int>(at->integer(0, kMostPaths));
  return predict;
}

StabilityQuery stability_from(JsonObject& fields) {
  StabilityQuery stability;
  if (const auto at = fields.require("object")) stability.object = at->text();
  read_number(fields, "max_move", kMoves, stability.max_move);
  if (const auto degrees = read_number(fields, "max_turn_deg", kTurnsDeg))
    stability.max_turn = geometry::kDegree * *degrees;
  read_number(fields, "duration", kDurations, stability.duration);
  if (const auto at = fields.find("effort")) stability.effort = effort_from(*at);
  if (const auto at = fields.find("detail")) stability.detail = stability_detail_from(*at);
  return stability;
}

ViewQuery view_from(JsonObject& fields) {
  ViewQuery view = view_question_from(fields);
  view.actions = actions_from(fields);
  return view;
}

AchieveQuery achieve_query_from(JsonObject& fields) {
  AchieveQuery achieve = achieve_from(fields);
  achieve.duration = read_number(fields, "duration", kDurations);
  if (const auto at = fields.find("effort")) achieve.effort = effort_from(*at, achieve.effort);
  return achieve;
}

Json estimate_json(const ObjectEstimate& estimate) {
  return {{"mean", to_json(estimate.mean)},
          {"covariance", matrix_json(estimate.covariance)},
          {"twist", to_json(estimate.twist)},
          {"mode", to_json(estimate.mode)},
          {"motion", to_string(estimate.motion)},
          {"confidence", estimate.confidence},
          {"effective_sample_size", estimate.effective_sample_size}};
}

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json margin_json(const StabilityMargin& margin) {
  Json falls = Json::array(), directions = Json::array();
  for (const FallImpulse& fall : margin.falls)
    falls.push_back({{"share", fall.share},
                     {"impulse", or_null(fall.impulse)},
                     {"interval", Json::array({or_null(fall.low), or_null(fall.high)})}});
  for (const StabilityMargin::Direction& direction : margin.directions)
    directions.push_back({{"direction", vector_json(direction.direction_W)}, {"impulse", or_null(direction.impulse)}});
  return {{"weakest_direction", vector_json(margin.weakest_W)},
          {"falls", std::move(falls)},
          {"directions", std::move(directions)},
          {"most_speed", margin.most_speed},
          {"starts", margin.starts},
          {"instances", margin.instances}};
}

Json removal_json(const Removal& removal) {
  Json moves = Json::array();
  for (const OutcomeProbability& other : removal.moves) moves.push_back(outcome_probability_json(other));
  return {{"others_stay", outcome_probability_json(removal.others_stay)},
          {"moves", std::move(moves)},
          {"instances", removal.instances}};
}

struct AnswerJson {
  Json operator()(const std::monostate&) const { return nullptr; }
  Json operator()(const WhereAnswer& where) const {
    Json items = Json::array();
    for (const WhereAnswer::Item& item : where.items)
      items.push_back({{"object", item.object},
                       {"model", item.model},
                       {"estimate", estimate_json(item.estimate)},
                       {"state", to_string(item.state)},
                       {"existence", item.existence},
                       {"parameters", to_json(item.parameters)},
                       {"lessons", item.lessons},
                       {"learned_ns", item.learned_ns},
                       {"alternatives", to_json(item.alternatives)}});
    Json json{{"items", std::move(items)}};
    if (!where.joints.empty()) json["joints"] = to_json(where.joints);
    return json;
  }
  Json operator()(const PredictAnswer& predict) const { return prediction_json(predict); }
  Json operator()(const StabilityAnswer& stability) const {
    Json json{{"object", stability.object},
              {"stable", outcome_probability_json(stability.stable)},
              {"likely_event", stability.likely_event}};
    if (stability.margin) json["margin"] = margin_json(*stability.margin);
    if (stability.removal) json["removal"] = removal_json(*stability.removal);
    add_basis(stability, json);
    return json;
  }
  Json operator()(const ViewAnswer& view) const { return view_answer_json(view); }
  Json operator()(const NextViewAnswer& next) const { return next_view_answer_json(next); }
  Json operator()(const AchieveAnswer& achieve) const { return achieve_answer_json(achieve); }
  Json operator()(const RelationsAnswer& relations) const { return relations_answer_json(relations); }
  Json operator()(const TimelineAnswer& timeline) const { return timeline_answer_json(timeline); }
};

}  // namespace

Json to_json(const Query& query) {
  Json json{{"id", query.id}};
  if (query.stream) json["stream"] = true;
  json[kTasks[query.what.index()]] = std::visit(QueryJson{}, query.what);
  return json;
}

core::Result<Query> query_from_json(std::string_view text) {
  PRESCENE_TRY(const Json document, parse_json(text, kLongestQuery));
  JsonErrors errors;
  // Read in place: what a move of the variant compiles to looks uninitialised to GCC.
  core::Result<Query> read{Query{}};
  Query& query = *read;
  {
    JsonObject object({document, "", errors});
    if (const auto id = object.find("id")) query.id = id->text();
    if (const auto stream = object.find("stream")) query.stream = stream->boolean();
    if (const auto explain = object.find("explain"))
      explain->fail(
          "this is asked of frames that were seen: ask a running 'serve', or 'prescene explain' of a recording");
    if (const auto why = object.find("why")) why->fail("this is asked of frames that were seen: ask a running 'serve'");
    if (const auto what = object.one_of(kTasks)) {
      JsonObject fields(what->second);
      if (what->first == "where") {
        WhereQuery where;
        if (const auto name = fields.find("object")) where.object = name->text();
        query.what = where;
      }
      if (what->first == "predict") query.what = predict_from(fields);
      if (what->first == "stability") query.what = stability_from(fields);
      if (what->first == "view") query.what = view_from(fields);
      if (what->first == "achieve") query.what = achieve_query_from(fields);
      if (what->first == "relations") query.what = relations_from(fields);
      if (what->first == "timeline") query.what = timeline_question_from(fields);
      if (what->first == "next_view") query.what = next_view_from(fields);
    }
  }
  if (!errors.ok()) return errors.status();
  PRESCENE_RETURN_IF_ERROR(validate(query));
  return read;
}

Json error_to_json(const core::Status& status) {
  PRESCENE_CHECK(!status.ok());
  const auto code = std::ranges::find(kCodes, status.code(), &CodeName::code);
  PRESCENE_CHECK(code != std::end(kCodes));
  return {{"error", status.message()}, {"code", code->name}};
}

core::Status error_from_json(const Json& document) {
  if (!document.is_object()) return core::ok_status();
  const auto error = document.find("error");
  if (error == document.end()) return core::ok_status();
  std::string message =
      error->is_string() ? error->get<std::string>() : error->dump(-1, ' ', false, Json::error_handler_t::replace);
  core::StatusCode code = core::StatusCode::kInvalidInput;
  const auto named = document.find("code");
  if (named != document.end() && named->is_string()) {
    const auto known = std::ranges::find(kCodes, named->get<std::string>(), &CodeName::name);
    if (known != std::end(kCodes)) code = known->code;
  }
  return {code, std::move(message)};
}

Json to_json(const Answer& answer) {
  Json json{{"id", answer.id}, {"step", answer.step}};
  if (answer.is_final) json["final"] = *answer.is_final;
  if (!answer.error.ok()) json.update(error_to_json(answer.error));
  if (answer.what.index() > 0) json[kTasks[answer.what.index() - 1]] = std::visit(AnswerJson{}, answer.what);
  return json;
}

}  // namespace prescene::belief
