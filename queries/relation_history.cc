// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/relation_history.h"

#include <algorithm>
#include <cmath>

#include "kept_shapes.h"
#include "prescene/belief/body_names.h"
#include "prescene/belief/timeline.h"
#include "prescene/core/check.h"
#include "prescene/core/spelling.h"
#include "prescene/queries/relations.h"
#include "prior.h"

namespace prescene::queries {
namespace {

using belief::RelationKind;
using belief::RelationProbability;

double probability_of(const std::vector<RelationProbability>& relations, RelationKind kind, const std::string& name) {
  double most = 0.0;
  for (const RelationProbability& relation : relations)
    if (relation.relation == kind && relation.subject == name) most = std::max(most, relation.probability);
  return most;
}

/// What an object does by itself, from its particles.
void add_motion(const belief::Belief& belief, const belief::ObjectBelief& object,
                std::vector<RelationProbability>& relations) {
  const geometry::Vector3d up_W = belief::up_of(*belief.scene);
  double moves = 0.0, falls = 0.0;
  for (const belief::Particle& particle : object.particles) {
    const double weight = std::exp(particle.log_weight);
    belief::ObjectState state;
    state.V_WO = particle.V_WO;
    state.mode = particle.mode;
    if (belief::is_moving(state)) moves += weight;
    if (particle.mode == belief::MotionMode::kMoving && up_W.dot(particle.V_WO.linear) < -belief::kFallingSpeed)
      falls += weight;
  }
  falls *= 1.0 - probability_of(relations, RelationKind::kOn, object.name);
  relations.push_back({RelationKind::kPresent, object.name, "", object.existence, 0.0, 1.0});
  relations.push_back({RelationKind::kMoves, object.name, "", std::min(1.0, moves), 0.0, 1.0});
  relations.push_back({RelationKind::kFalls, object.name, "", std::min(1.0, falls), 0.0, 1.0});
  if (belief.scene->camera)
    relations.push_back({RelationKind::kHidden, object.name, "",
                         1.0 - probability_of(relations, RelationKind::kVisible, object.name), 0.0, 1.0});
}

core::Result<belief::TimelineAnswer> answer_of(std::vector<std::string> known, const belief::TimelineQuery& query,
                                               const QueryContext& context) {
  const std::shared_ptr<const belief::ObservedTimeline> timeline = context.timeline ? context.timeline() : nullptr;
  if (!timeline)
    return core::unavailable(
        "nothing was observed yet: ask a `serve` that has seen frames, or replay a recording with --timeline");
  for (const belief::ObservedInterval& interval : timeline->intervals) {
    known.push_back(interval.subject);
    if (!interval.other.empty()) known.push_back(interval.other);
  }
  for (const auto& pattern : {query.first, query.second}) {
    if (!pattern) continue;
    for (const std::string& name : {pattern->subject, pattern->other}) {
      if (name.empty() || std::ranges::find(known, name) != known.end()) continue;
      const std::string near = core::did_you_mean(name, known);
      return core::not_found("there is no '" + name +
                             "' in the scene or its past: " + (near.empty() ? "ask 'where' for the objects" : near));
    }
  }
  return belief::match(*timeline, query);
}

std::vector<std::string> names_in(const belief::Scene& scene) {
  std::vector<std::string> names;
  for (const belief::SceneObject& object : scene.objects) names.push_back(object.name);
  for (const belief::Support& support : scene.supports) names.push_back(support.name);
  for (const belief::KinematicBody& body : scene.robot) names.push_back(body.name);
  return names;
}

}  // namespace

RelationHistory::RelationHistory(const HistoryOptions& options)
    : options_(options), shapes_(std::make_shared<KeptShapes>()) {
  PRESCENE_CHECK(options.seconds > 0.0 && options.most_intervals > 0);
  PRESCENE_CHECK(0.0 < options.ends && options.ends <= options.begins && options.begins < 1.0);
}

core::Status RelationHistory::add(const belief::Belief& belief, const QueryContext& context) {
  std::vector<RelationProbability> relations;
  if (std::ranges::any_of(belief.objects, is_present)) {
    belief::RelationsQuery query;
    query.draws = options_.draws;
    auto answer = queries::relations(belief, query, context, *shapes_);
    if (!answer) {
      fail(answer.status().message());
      return answer.status();
    }
    relations = std::move(answer->relations);
    for (const belief::ObjectBelief& object : belief.objects)
      if (is_present(object)) add_motion(belief, object, relations);
  }
  add(belief.stamp_ns, relations);
  return core::ok_status();
}

void RelationHistory::add(core::TimeNs stamp_ns, const std::vector<RelationProbability>& relations) {
  const bool is_first = now_.frames == 0 || stamp_ns <= now_.to_ns;
  if (is_first) {
    open_.clear();
    closed_.clear();
    belief::ObservedTimeline fresh;
    fresh.session_ns = fresh.from_ns = fresh.to_ns = stamp_ns;
    fresh.skipped = now_.skipped;
    fresh.failed = now_.failed;
    fresh.last_failure = now_.last_failure;
    now_ = std::move(fresh);
  }
  std::map<Key, double> probabilities;
  for (const auto& [key, open] : open_) probabilities[key] = 0.0;
  for (const RelationProbability& relation : relations)
    probabilities[{relation.relation, relation.subject, relation.other}] = relation.probability;
  for (const auto& [key, probability] : probabilities) {
    const auto found = open_.find(key);
    const auto& [kind, subject, other] = key;
    if (found == open_.end()) {
      if (probability < options_.begins) continue;
      open_[key] = {stamp_ns, is_first, probability, 1};
      if (kind == RelationKind::kPresent && !is_first)
        note_event(RelationKind::kAppears, subject, stamp_ns, probability);
    } else if (probability <= options_.ends) {
      close(key, found->second, stamp_ns);
      open_.erase(found);
      if (kind == RelationKind::kPresent) note_event(RelationKind::kDisappears, subject, stamp_ns, 1.0 - probability);
    } else {
      found->second.sum += probability;
      ++found->second.frames;
    }
  }
  now_.to_ns = stamp_ns;
  ++now_.frames;
  forget();
}

void RelationHistory::fail(const std::string& why) {
  ++now_.failed;
  now_.last_failure = why;
}

void RelationHistory::close(const Key& key, const Open& open, core::TimeNs end_ns) {
  const auto& [kind, subject, other] = key;
  closed_.push_back(
      {kind, subject, other, open.begin_ns, end_ns, false, open.began_before, open.sum / open.frames, open.frames});
}

void RelationHistory::note_event(RelationKind kind, const std::string& object, core::TimeNs stamp_ns,
                                 double probability) {
  closed_.push_back({kind, object, "", now_.to_ns, stamp_ns, false, false, probability, 1});
}

void RelationHistory::forget() {
  now_.from_ns = std::max(now_.session_ns, now_.to_ns - core::ns_of(options_.seconds));
  std::erase_if(closed_, [&](const belief::ObservedInterval& interval) { return interval.end_ns < now_.from_ns; });
  while (!closed_.empty() && closed_.size() + open_.size() > options_.most_intervals) {
    closed_.erase(closed_.begin());
    ++now_.forgotten;
  }
  // More goes on at once than there is room for: those that began last are left out.
  while (open_.size() > options_.most_intervals) {
    const auto latest = std::ranges::max_element(
        open_, [](const auto& a, const auto& b) { return a.second.begin_ns < b.second.begin_ns; });
    open_.erase(latest);
    ++now_.forgotten;
  }
}

std::shared_ptr<const belief::ObservedTimeline> RelationHistory::timeline() const {
  if (now_.frames == 0) return nullptr;
  auto timeline = std::make_shared<belief::ObservedTimeline>(now_);
  timeline->intervals = closed_;
  for (const auto& [key, open] : open_) {
    const auto& [kind, subject, other] = key;
    timeline->intervals.push_back({kind, subject, other, open.begin_ns, now_.to_ns, true, open.began_before,
                                   open.sum / open.frames, open.frames});
  }
  std::ranges::stable_sort(timeline->intervals, [](const auto& a, const auto& b) {
    return std::tie(a.begin_ns, a.relation, a.subject, a.other) < std::tie(b.begin_ns, b.relation, b.subject, b.other);
  });
  return timeline;
}

core::Result<belief::TimelineAnswer> observed(const belief::Belief& belief, const belief::TimelineQuery& query,
                                              const QueryContext& context) {
  std::vector<std::string> names = names_in(*belief.scene);
  for (const belief::ObjectBelief& object : belief.objects) names.push_back(object.name);
  return answer_of(std::move(names), query, context);
}

core::Result<belief::TimelineAnswer> observed(const belief::Scene& scene, const belief::TimelineQuery& query,
                                              const QueryContext& context) {
  return answer_of(names_in(scene), query, context);
}

}  // namespace prescene::queries
