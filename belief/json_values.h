// SPDX-License-Identifier: Apache-2.0
// JSON of the small values that the larger ones are made of, both ways. Numbers are written so that they read back as
// the same bits; what JSON can't say (infinite, not a number) is null.
#pragma once

#include "json_reader.h"
#include "prescene/belief/belief.h"

namespace prescene::belief {

Json vector_json(const Vector3d& vector);
Vector3d vector_from(const JsonAt& at);
/// Rows of numbers.
Json matrix_json(const Eigen::MatrixXd& matrix);
Eigen::MatrixXd matrix_from(const JsonAt& at, Eigen::Index size);
Json scalar_json(const ScalarDistribution& distribution);
ScalarDistribution scalar_from(const JsonAt& at);
Json vector_distribution_json(const Vector3Distribution& distribution);
Vector3Distribution vector_distribution_from(const JsonAt& at);
/// "x", "-x", ... or [x, y, z] of any length, which is made a unit vector.
Json axis_json(const Vector3d& axis);
Vector3d axis_from(const JsonAt& at);
/// null where it is not finite.
Json number_json(double value);
struct ScalarRange;
/// The key's number, or an error at its place where it is out of the range.
std::optional<double> read_number(JsonObject& fields, const std::string& key, const ScalarRange& range);
/// The keys `position` and `rotation`, both of which may be absent.
void read_pose(JsonObject& fields, Pose& pose);
Pose pose_from(const JsonAt& at);
Json pose_distribution_json(const PoseDistribution& distribution);
PoseDistribution pose_distribution_from(const JsonAt& at);
Twist twist_from(const JsonAt& at);

const std::vector<std::pair<std::string, MotionMode>>& motion_mode_words();
const std::vector<std::pair<std::string, TrackState>>& track_state_words();
const std::vector<std::pair<std::string, When>>& when_words();
template <class Enum>
std::string word_of(const std::vector<std::pair<std::string, Enum>>& words, Enum value) {
  for (const auto& [word, meaning] : words)
    if (meaning == value) return word;
  return {};
}

Action action_from(const JsonAt& at);
/// Of a list of outcomes with their names, or a map from names, as in scene files; `object` is judged where an outcome
/// names none, "" = the only one of the scene (complete_outcome()).
std::vector<Outcome> outcomes_from(const JsonAt& at, const std::string& object);
std::vector<ExclusiveOutcomes> groups_from(const JsonAt& at);
Json exclusive_json(const ExclusiveOutcomes& group);
struct Basis;
struct OutcomeProbability;
struct PredictAnswer;
Json outcome_probability_json(const OutcomeProbability& outcome);
/// Puts its fields into the object.
void add_basis(const Basis& basis, Json& json);
Json prediction_json(const PredictAnswer& predict);

}  // namespace prescene::belief
