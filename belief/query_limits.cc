// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/query_limits.h"

#include <cmath>

#include "prescene/belief/action_schema.h"
#include "prescene/core/text.h"
#include "prescene/core/utf8.h"

namespace prescene::belief {
namespace {

using core::Status;

Status check_count(std::size_t count, std::size_t most, const char* what) {
  if (count <= most) return {};
  return core::resource_exhausted(std::to_string(count) + " " + what + ": ask for at most " + std::to_string(most) +
                                  " at a time");
}

Status check_text(const std::string& text, std::size_t most, const char* what) {
  if (text.size() > most)
    return core::invalid_input(std::string(what) + " has " + std::to_string(text.size()) + " bytes: give at most " +
                               std::to_string(most));
  if (!core::is_utf8(text)) return core::invalid_input(std::string(what) + " is not UTF-8: give text");
  return {};
}

Status check_draws(int draws) {
  if (draws >= kFewestViewDraws && draws <= kMostViewDraws) return {};
  return core::invalid_input("draws: " + std::to_string(draws) + " is out of range: give " +
                             std::to_string(kFewestViewDraws) + " to " + std::to_string(kMostViewDraws));
}

Status check_camera_pose(const Pose& X_WC) {
  if (!X_WC.translation.allFinite() || X_WC.translation.cwiseAbs().maxCoeff() > kLengthRange.high)
    return core::invalid_input("a position out of range: " + std::string(kLengthRange.remedy));
  if (!(std::abs(X_WC.rotation.norm() - 1.0) < 1e-6))
    return core::invalid_input("a rotation that is none: give a quaternion of length 1");
  return {};
}

Status check_intrinsics(const geometry::PinholeCamera& camera) {
  PRESCENE_RETURN_IF_ERROR(geometry::validate(camera));
  if (std::int64_t{camera.width} * camera.height <= kMostViewPixels) return {};
  return core::resource_exhausted(std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                                  " pixels: give at most " + std::to_string(kMostViewPixels) + " in all");
}

/// Counts what is judged.
struct Judged {
  std::size_t outcomes = 0, conditions = 0;

  Status add(const Outcome& outcome) {
    ++outcomes;
    conditions += outcome.all_of.size() + outcome.any_of.size();
    return check_text(outcome.name, kLongestName, "an outcome's name");
  }
  Status check() const {
    PRESCENE_RETURN_IF_ERROR(check_count(outcomes, kMostOutcomes, "outcomes"));
    return check_count(conditions, kMostConditions, "conditions");
  }
};

struct QueryCheck {
  Status operator()(const WhereQuery& where) const {
    return where.object ? check_text(*where.object, kLongestName, "object: the name") : Status();
  }
  Status operator()(const PredictQuery& predict) const {
    PRESCENE_RETURN_IF_ERROR(check_count(predict.actions.size(), kMostActions, "actions"));
    PRESCENE_RETURN_IF_ERROR(check_count(predict.exclusive_outcomes.size(), kMostOutcomes, "exclusive_outcomes"));
    Judged judged;
    for (const Outcome& outcome : predict.outcomes) PRESCENE_RETURN_IF_ERROR(judged.add(outcome).at("outcomes"));
    for (const ExclusiveOutcomes& group : predict.exclusive_outcomes) {
      PRESCENE_RETURN_IF_ERROR(check_text(group.name, kLongestName, "a group's name").at("exclusive_outcomes"));
      for (const Outcome& outcome : group.outcomes)
        PRESCENE_RETURN_IF_ERROR(judged.add(outcome).at("exclusive_outcomes"));
    }
    PRESCENE_RETURN_IF_ERROR(judged.check());
    if (predict.duration) PRESCENE_RETURN_IF_ERROR(check_number(*predict.duration, kDurations).at("duration"));
    if (predict.detail.paths < 0 || predict.detail.paths > kMostPaths)
      return core::invalid_input("paths: " + std::to_string(predict.detail.paths) + " is out of range: give 0 to " +
                                 std::to_string(kMostPaths));
    return validate(predict.effort);
  }
  Status operator()(const StabilityQuery& stability) const {
    PRESCENE_RETURN_IF_ERROR(check_text(stability.object, kLongestName, "object: the name"));
    PRESCENE_RETURN_IF_ERROR(check_number(stability.max_move, kMoves).at("max_move"));
    PRESCENE_RETURN_IF_ERROR(check_number(stability.max_turn, kTurns).at("max_turn"));
    PRESCENE_RETURN_IF_ERROR(check_number(stability.duration, kDurations).at("duration"));
    return validate(stability.effort);
  }
  Status operator()(const ViewQuery& view) const {
    PRESCENE_RETURN_IF_ERROR(check_count(view.actions.size(), kMostActions, "actions"));
    PRESCENE_RETURN_IF_ERROR(check_draws(view.draws));
    if (view.X_WC) PRESCENE_RETURN_IF_ERROR(check_camera_pose(*view.X_WC).at("pose"));
    if (view.intrinsics) PRESCENE_RETURN_IF_ERROR(check_intrinsics(*view.intrinsics).at("intrinsics"));
    return check_number(view.time, kViewTimes).at("time");
  }
  Status operator()(const NextViewQuery& next) const {
    PRESCENE_RETURN_IF_ERROR(check_text(next.object, kLongestName, "object: the name"));
    if (next.views.empty()) return core::invalid_input("views: there is none: give the camera poses to choose from");
    PRESCENE_RETURN_IF_ERROR(check_count(next.views.size(), kMostViews, "views"));
    for (std::size_t i = 0; i < next.views.size(); ++i) {
      const std::string place = "views[" + std::to_string(i) + "]";
      const CandidateView& view = next.views[i];
      PRESCENE_RETURN_IF_ERROR(check_text(view.name, kLongestName, "the name").at(place));
      PRESCENE_RETURN_IF_ERROR(check_camera_pose(view.X_WC).at(place + ".pose"));
      if (view.intrinsics) PRESCENE_RETURN_IF_ERROR(check_intrinsics(*view.intrinsics).at(place + ".intrinsics"));
    }
    PRESCENE_RETURN_IF_ERROR(check_draws(next.draws));
    return check_number(next.confidence, kConfidences).at("confidence");
  }
  Status operator()(const AchieveQuery& achieve) const;
  Status operator()(const RelationsQuery& relations) const {
    if (relations.object) PRESCENE_RETURN_IF_ERROR(check_text(*relations.object, kLongestName, "object: the name"));
    if (relations.draws < kFewestRelationDraws || relations.draws > kMostRelationDraws)
      return core::invalid_input("draws: " + std::to_string(relations.draws) + " is out of range: give " +
                                 std::to_string(kFewestRelationDraws) + " to " + std::to_string(kMostRelationDraws));
    PRESCENE_RETURN_IF_ERROR(check_number(relations.confidence, kConfidences).at("confidence"));
    PRESCENE_RETURN_IF_ERROR(check_number(relations.upright_within, kTurns).at("upright_within"));
    if (!relations.reach) return {};
    PRESCENE_RETURN_IF_ERROR(check_text(relations.reach->of, kLongestName, "reach.of: the name"));
    if (!relations.reach->point_W.allFinite() || relations.reach->point_W.cwiseAbs().maxCoeff() > kLengthRange.high)
      return core::invalid_input("reach.of: a point out of range: " + std::string(kLengthRange.remedy));
    return check_number(relations.reach->radius, kReaches).at("reach.radius");
  }
  Status operator()(const TimelineQuery& timeline) const {
    for (const auto& pattern : {timeline.first, timeline.second}) {
      if (!pattern) continue;
      PRESCENE_RETURN_IF_ERROR(check_text(pattern->subject, kLongestName, "a subject's name"));
      PRESCENE_RETURN_IF_ERROR(check_text(pattern->other, kLongestName, "another thing's name"));
    }
    if (timeline.second && !timeline.first) return core::invalid_input("second: it needs a first");
    return check_count(timeline.relations.size(), allen_words().size(), "relations between intervals");
  }
};

/// Both ends of a range, or neither; not empty.
Status check_range(const ParameterRange& range) {
  if (range.low.has_value() != range.high.has_value())
    return core::invalid_input("one end of its range is missing: give both, or none");
  if (!range.low) return {};
  if (!std::isfinite(*range.low) || !std::isfinite(*range.high))
    return core::invalid_input("an end of its range is not a number: give two numbers");
  if (!(*range.low < *range.high))
    return core::invalid_input("the range from " + core::rounded_text(*range.low) + " to " +
                               core::rounded_text(*range.high) +
                               " is empty: give the lower end first, or fix the parameter");
  return {};
}

Status check_errors(const ActionErrors& errors) {
  const auto check_deviations = [](const Vector3d& deviations, double most, const char* what) -> Status {
    if (deviations.allFinite() && deviations.minCoeff() >= 0.0 && deviations.maxCoeff() <= most) return {};
    return core::invalid_input(std::string(what) + ": give standard deviations of at least 0 and at most " +
                               core::rounded_text(most));
  };
  PRESCENE_RETURN_IF_ERROR(check_deviations(errors.position, 10.0, "position"));
  PRESCENE_RETURN_IF_ERROR(check_deviations(errors.rotation, 3.2, "rotation_deg"));
  constexpr ScalarRange kDelays{0.0, 3600.0, "give seconds of at least 0; a normal distribution needs \"min\": 0",
                                true};
  PRESCENE_RETURN_IF_ERROR(check_scalar(errors.delay, kDelays).at("delay"));
  PRESCENE_RETURN_IF_ERROR(check_scalar(errors.lateral_error, kLengthRange).at("lateral_error"));
  if (!errors.disturbance) return {};
  PRESCENE_RETURN_IF_ERROR(check_vector(errors.disturbance->linear, kSpeedRange).at("velocity"));
  return check_vector(errors.disturbance->angular, kSpeedRange).at("angular_velocity");
}

Status QueryCheck::operator()(const AchieveQuery& achieve) const {
  PRESCENE_RETURN_IF_ERROR(check_text(achieve.outcome, 2 * kLongestName + 1, "outcome: the name"));
  PRESCENE_RETURN_IF_ERROR(check_text(achieve.object, kLongestName, "object: the name"));
  PRESCENE_RETURN_IF_ERROR(check_text(achieve.support, kLongestName, "support: the name"));
  PRESCENE_RETURN_IF_ERROR(check_text(achieve.action, kLongestName, "action: the name"));
  if (achieve.wanted) {
    Judged judged;
    PRESCENE_RETURN_IF_ERROR(judged.add(*achieve.wanted).at("outcome"));
    PRESCENE_RETURN_IF_ERROR(judged.check().at("outcome"));
  }
  PRESCENE_RETURN_IF_ERROR(check_count(achieve.free.size(), kMostFree, "free parameters"));
  PRESCENE_RETURN_IF_ERROR(check_count(achieve.fixed.size(), kMostFree, "fixed parameters"));
  PRESCENE_TRY(const ActionSchema* schema, find_action_schema(achieve.action));
  const auto check_name = [schema](const std::string& name) -> Status {
    PRESCENE_RETURN_IF_ERROR(check_text(name, kLongestName, "a parameter's name"));
    if (name == "position" && find_action_parameter(*schema, "x").ok()) return {};  // x and y
    return find_action_parameter(*schema, name).status();
  };
  for (const ParameterRange& range : achieve.free) {
    PRESCENE_RETURN_IF_ERROR(check_name(range.name).at("free"));
    PRESCENE_RETURN_IF_ERROR(check_range(range).at("free." + range.name));
  }
  for (const ParameterValue& value : achieve.fixed) PRESCENE_RETURN_IF_ERROR(check_name(value.name).at("fixed"));
  PRESCENE_RETURN_IF_ERROR(check_errors(achieve.errors).at("errors"));
  PRESCENE_RETURN_IF_ERROR(check_number(achieve.probability, kWantedProbabilities).at("probability"));
  if (achieve.duration) PRESCENE_RETURN_IF_ERROR(check_number(*achieve.duration, kDurations).at("duration"));
  return validate(achieve.effort);
}

}  // namespace

Status check_number(double value, const ScalarRange& range) {
  if (value >= range.low && value <= range.high) return {};
  return core::invalid_input(
      core::rounded_text(value) + " is out of range: " + range.remedy +
      // Where the remedy says "above 0", this is.
      (value > 0.0 && value < range.low ? "; the least is " + core::rounded_text(range.low) : ""));
}

Status validate(const Effort& effort) {
  PRESCENE_RETURN_IF_ERROR(check_number(effort.tolerance, kTolerances).at("effort.tolerance"));
  PRESCENE_RETURN_IF_ERROR(check_number(effort.confidence, kConfidences).at("effort.confidence"));
  PRESCENE_RETURN_IF_ERROR(check_number(effort.max_instances, kInstances).at("effort.max_instances"));
  if (effort.exact_instances)
    PRESCENE_RETURN_IF_ERROR(check_number(*effort.exact_instances, kInstances).at("effort.exact_instances"));
  if (effort.max_seconds)
    PRESCENE_RETURN_IF_ERROR(check_number(*effort.max_seconds, kWallSeconds).at("effort.max_seconds"));
  return {};
}

Status validate(const Query& query) {
  PRESCENE_RETURN_IF_ERROR(check_text(query.id, kLongestId, "id: the text"));
  return std::visit(QueryCheck{}, query.what);
}

}  // namespace prescene::belief
