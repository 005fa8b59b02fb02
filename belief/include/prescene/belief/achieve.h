// SPDX-License-Identifier: Apache-2.0
// Which parameters of an action bring a wanted outcome about: the question and its answer. Plain values; queries/
// answers, prescene/belief/json.h reads and writes them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/action.h"
#include "prescene/belief/effort.h"
#include "prescene/belief/outcome.h"
#include "prescene/belief/prediction.h"

namespace prescene::belief {

/// A parameter by its name in the action's schema (prescene/belief/action_schema.h), and its value there.
struct ParameterValue {
  std::string name;
  double value = 0.0;
  friend bool operator==(const ParameterValue&, const ParameterValue&) = default;
};
/// A parameter that is searched, between two values; nothing: the schema's or the scene's.
struct ParameterRange {
  std::string name;  ///< "position" stands for x and y.
  std::optional<double> low, high;
  friend bool operator==(const ParameterRange&, const ParameterRange&) = default;
};
/// What is not exact when the action is executed; what is empty is exact, or as the scene's own release of the object.
struct ActionErrors {
  Vector3d position = Vector3d::Zero();                 ///< Standard deviations of where the object is let go, m, in W.
  Vector3d rotation = Vector3d::Zero();                 ///< Of a small turn about the object's own axes, rad.
  ScalarDistribution delay = FixedScalar{0.0};          ///< Between the command and the action, s, at least 0.
  ScalarDistribution lateral_error = FixedScalar{0.0};  ///< Of a push: shift to its left, m.
  /// What the opening hand adds to the object's velocity.
  std::optional<TwistDistribution> disturbance;
  friend bool operator==(const ActionErrors&, const ActionErrors&) = default;
};

/// How must it be done, so that...?
struct AchieveQuery {
  /// Name of one of the scene's outcomes, or of one in an exclusive group ("in_bin", "where.in_bin"). Empty: `wanted`.
  std::string outcome;
  std::optional<Outcome> wanted;
  std::string action = "place";       ///< A name of action_schemas().
  std::string object;                 ///< Empty: that of the own action, the one that is held, or the outcome's.
  std::string support;                ///< Of place. Empty: the one that the outcome names.
  std::vector<ParameterRange> free;   ///< At least one.
  std::vector<ParameterValue> fixed;  ///< The others: those not named have their schema's or the scene's values.
  ActionErrors errors;
  double probability = 0.95;  ///< That is wanted.
  /// Also the most robust choice, the map and why the rest fails; else the answer ends with the first certified choice.
  bool survey = true;
  std::optional<double> duration;  ///< Empty: the scene's.
  Effort effort = {0.02, 0.95, 8192, std::nullopt, std::nullopt};
  friend bool operator==(const AchieveQuery&, const AchieveQuery&) = default;
};

/// A choice of the free parameters, with what instances say of it that had no part in finding it.
struct ActionChoice {
  std::vector<double> values;     ///< In the order of AchieveAnswer::parameters.
  std::vector<double> low, high;  ///< Of a neighbourhood: each parameter may be anywhere between. Empty: just `values`.
  std::optional<Pose> X_WO;       ///< Of place: where the object is let go; of pour and insert: where it is brought.
  std::optional<Action> action;   ///< The same as an action of a prediction.
  double probability = 0.0;       ///< Share of `instances` with the outcome.
  double lower = 0.0, upper = 1.0;  ///< Its interval of the wanted confidence.
  int instances = 0;
  bool certified = false;  ///< `lower` has reached the wanted probability.
  friend bool operator==(const ActionChoice&, const ActionChoice&) = default;
};

/// A choice that looks good so far. As it was chosen for that, it is probably not quite as good: there is no interval.
struct ActionCandidate {
  std::vector<double> values;  ///< In the order of AchieveAnswer::parameters.
  std::optional<Pose> X_WO;    ///< As in ActionChoice.
  double expected = 0.0;       ///< Probability of the outcome, guessed from its instances and those of its neighbours.
  int instances = 0;           ///< Of its own.
  friend bool operator==(const ActionCandidate&, const ActionCandidate&) = default;
};

/// A parameter that was searched.
struct SearchedParameter {
  std::string name, unit;
  double low = 0.0, high = 0.0;
  /// Of the best choice, when this parameter alone is anywhere in its range: the share that fails. The larger, the more
  /// the parameter decides.
  double fails_alone = 0.0;
  std::vector<double> profile;  ///< Share with the outcome along the range, the others being at the best choice.
  friend bool operator==(const SearchedParameter&, const SearchedParameter&) = default;
};

/// Shares with the outcome over two parameters, the others being at the best choice.
struct ActionMap {
  std::string x, y;  ///< Names of the parameters.
  int nx = 0, ny = 0;
  std::vector<double> share;  ///< Of cell (ix, iy), evenly over the ranges: iy * nx + ix; -1: it can't be done there.
  int instances_per_cell = 0;
  friend bool operator==(const ActionMap&, const ActionMap&) = default;
};

/// What happens instead.
struct FailureReason {
  std::string what;    ///< The condition that does not hold, or the outcome of the same group that does.
  std::string event;   ///< What the object does, in words; empty: not simulated, as it can't be done.
  double share = 0.0;  ///< Of all choices.
  friend bool operator==(const FailureReason&, const FailureReason&) = default;
};

struct AchieveAnswer : Basis {
  std::string outcome, action, object, support;
  double wanted = 0.95;
  double confidence = 0.95;
  bool found = false;  ///< `best` is certified.
  std::vector<SearchedParameter> parameters;
  ActionChoice best;
  /// The centre of the largest neighbourhood that was found in which the outcome comes about with the wanted
  /// probability.
  std::optional<ActionChoice> robust;
  std::vector<ActionChoice> choices;        ///< Certified ones, in the order in which they were found.
  std::vector<ActionCandidate> candidates;  ///< At most ten, the best first, whether certified or not.
  std::optional<ActionMap> map;
  std::vector<FailureReason> failures;  ///< Most frequent first.
  OutcomeProbability anywhere;          ///< With the parameters drawn anywhere in their ranges.
  double impossible = 0.0;              ///< Share of the ranges in which it can't be done, as something is in the way.
  int search_instances = 0;             ///< Of `instances`; Effort::exact_instances is about these.
  int attempts = 0;                     ///< Choices that were put to the test with fresh instances.
  int first_certified_instances = 0;    ///< All instances up to the first certified choice; 0 = none.
  double first_certified_simulated = 0.0;  ///< Simulated seconds until then.
  double first_certified_seconds = 0.0;    ///< Wall time until then, s.
  friend bool operator==(const AchieveAnswer&, const AchieveAnswer&) = default;
};

}  // namespace prescene::belief
