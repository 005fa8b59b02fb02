// SPDX-License-Identifier: Apache-2.0
// JSON of questions about relations and timelines, and of their answers.
#include "json_relations.h"

#include "prescene/belief/json.h"
#include "prescene/belief/query_limits.h"
#include "prescene/geometry/angles.h"

namespace prescene::belief {
namespace {

Json reach_json(const Reach& reach) {
  Json json = Json::object();
  if (reach.of.empty())
    json["of"] = vector_json(reach.point_W);
  else
    json["of"] = reach.of;
  json["radius"] = reach.radius;
  return json;
}

Reach reach_from(const JsonAt& at) {
  Reach reach;
  JsonObject fields(at);
  if (const auto of = fields.require("of")) {
    if (of->value.is_string())
      reach.of = of->text();
    else
      reach.point_W = vector_from(*of);
    if (of->value.is_string() && reach.of.empty())
      of->fail("the name is empty: give a robot body, \"camera\" or a point");
  }
  reach.radius = read_number(fields, "radius", kReaches).value_or(reach.radius);
  return reach;
}

Json pattern_json(const IntervalPattern& pattern) {
  Json json{{"relation", to_string(pattern.relation)}};
  if (!pattern.subject.empty()) json["subject"] = pattern.subject;
  if (!pattern.other.empty()) json["other"] = pattern.other;
  return json;
}

/// {"relation": "touches", "subject": "carton", "other": "mug"}, or "touches carton mug".
IntervalPattern pattern_from(const JsonAt& at) {
  if (at.value.is_string()) {
    const auto pattern = pattern_from_text(at.text());
    if (!pattern) return at.fail(pattern.status().message()), IntervalPattern();
    return *pattern;
  }
  IntervalPattern pattern;
  JsonObject fields(at);
  if (const auto word = fields.require("relation")) pattern.relation = word->word(relation_words());
  if (const auto name = fields.find("subject")) pattern.subject = name->text();
  const auto other = fields.find("other");
  if (other) pattern.other = other->text();
  if (other && !is_between_two(pattern.relation))
    other->fail("'" + to_string(pattern.relation) + "' is of one thing: leave this out");
  return pattern;
}

/// Seconds after the first frame that was looked at.
double seconds_in(const ObservedTimeline& timeline, core::TimeNs stamp_ns) {
  return core::seconds_of(stamp_ns - timeline.session_ns);
}

}  // namespace

Json relations_json(const RelationsQuery& query) {
  Json json = Json::object();
  if (query.object) json["object"] = *query.object;
  json["draws"] = query.draws;
  json["confidence"] = query.confidence;
  json["upright_deg"] = geometry::exact_degrees(query.upright_within);
  if (query.reach) json["reach"] = reach_json(*query.reach);
  return json;
}

RelationsQuery relations_from(JsonObject& fields) {
  RelationsQuery query;
  if (const auto name = fields.find("object")) query.object = name->text();
  if (const auto draws = fields.find("draws"))
    query.draws = static_cast<int>(draws->integer(kFewestRelationDraws, kMostRelationDraws));
  query.confidence = read_number(fields, "confidence", kConfidences).value_or(query.confidence);
  if (const auto degrees = read_number(fields, "upright_deg", kTurnsDeg))
    query.upright_within = geometry::kDegree * *degrees;
  if (const auto reach = fields.find("reach")) query.reach = reach_from(*reach);
  return query;
}

Json relations_answer_json(const RelationsAnswer& answer) {
  Json objects = Json::array(), relations = Json::array();
  for (const RelationsAnswer::Item& item : answer.objects)
    objects.push_back(
        {{"object", item.object},
         {"state", to_string(item.state)},
         {"existence", item.existence},
         {"effective_sample_size", item.effective_sample_size ? Json(*item.effective_sample_size) : Json(nullptr)},
         {"tolerance", item.tolerance}});
  for (const RelationProbability& relation : answer.relations) {
    Json json{{"relation", to_string(relation.relation)}, {"subject", relation.subject}};
    if (is_between_two(relation.relation)) json["other"] = relation.other;
    json["probability"] = relation.probability;
    json["interval"] = Json::array({relation.low, relation.high});
    if (relation.share) json["share"] = *relation.share;
    relations.push_back(std::move(json));
  }
  return {{"objects", std::move(objects)},
          {"relations", std::move(relations)},
          {"draws", answer.draws},
          {"failed_draws", answer.failed_draws},
          {"remarks", answer.remarks}};
}

Json timeline_question_json(const TimelineQuery& query) {
  Json json = Json::object();
  if (query.first) json["first"] = pattern_json(*query.first);
  if (query.second) json["second"] = pattern_json(*query.second);
  if (!query.relations.empty()) {
    json["relation"] = Json::array();
    for (const AllenRelation relation : query.relations) json["relation"].push_back(to_string(relation));
  }
  return json;
}

TimelineQuery timeline_question_from(JsonObject& fields) {
  TimelineQuery query;
  if (const auto first = fields.find("first")) query.first = pattern_from(*first);
  const auto second = fields.find("second");
  if (second) query.second = pattern_from(*second);
  if (second && !query.first) second->fail("'second' needs a 'first'");
  const auto relation = fields.find("relation");
  if (!relation) return query;
  if (!query.second) relation->fail("it is between two intervals: give 'first' and 'second', too");
  if (relation->value.is_string()) {
    query.relations.push_back(relation->word(allen_words()));
    return query;
  }
  for (const JsonAt& item : relation->items()) query.relations.push_back(item.word(allen_words()));
  if (query.relations.size() > allen_words().size()) relation->fail("there are 13 relations: name each once");
  return query;
}

Json timeline_answer_json(const TimelineAnswer& answer) {
  const ObservedTimeline& timeline = answer.timeline;
  Json intervals = Json::array();
  for (const ObservedInterval& interval : timeline.intervals) {
    Json json{{"relation", to_string(interval.relation)}, {"subject", interval.subject}};
    if (is_between_two(interval.relation)) json["other"] = interval.other;
    json.update({{"begin", seconds_in(timeline, interval.begin_ns)},
                 {"end", seconds_in(timeline, interval.end_ns)},
                 {"begin_ns", interval.begin_ns},
                 {"end_ns", interval.end_ns},
                 {"goes_on", interval.goes_on},
                 {"began_before", interval.began_before},
                 {"probability", interval.probability},
                 {"frames", interval.frames}});
    intervals.push_back(std::move(json));
  }
  Json json{{"from", seconds_in(timeline, timeline.from_ns)},
            {"to", seconds_in(timeline, timeline.to_ns)},
            {"session_ns", timeline.session_ns},
            {"frames", timeline.frames},
            {"skipped_frames", timeline.skipped},
            {"failed_frames", timeline.failed},
            {"last_failure", timeline.last_failure},
            {"forgotten", timeline.forgotten},
            {"intervals", std::move(intervals)}};
  if (!answer.of_pairs) return json;
  json["pairs"] = Json::array();
  for (const TimelineAnswer::Pair& pair : answer.pairs)
    json["pairs"].push_back({{"first", pair.first},
                             {"second", pair.second},
                             {"relation", to_string(pair.relation)},
                             {"probability", pair.probability},
                             {"may_change", pair.may_change}});
  return json;
}

}  // namespace prescene::belief
