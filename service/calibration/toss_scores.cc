// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/toss_scores.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "prescene/core/check.h"
#include "prescene/geometry/resting_poses.h"
#include "prescene/service/calibration/forecast_scores.h"

namespace prescene::service {
namespace {

// Of the places' density: regions of 64 samples then hold the share that they promise, and the kernels are no narrower
// than what a resting place is known to (a share of the radius of gyration).
constexpr double kKernelScale = 1.2;
constexpr double kKernelFloor = 0.045;
constexpr int kResamples = 200;
constexpr std::array kLevels = {0.5, 0.8, 0.9, 0.95};
constexpr std::array kBins = {0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0};

/// Places of the tosses of each group.
std::vector<std::vector<std::size_t>> groups_of(std::span<const ScoredToss> tosses) {
  std::map<std::size_t, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < tosses.size(); ++i) groups[tosses[i].group].push_back(i);
  std::vector<std::vector<std::size_t>> all;
  for (auto& [number, places] : groups) all.push_back(std::move(places));
  return all;
}

ScoreValue mean_value(const std::vector<double>& values, const std::vector<std::vector<std::size_t>>& groups) {
  ScoreValue result;
  const auto n = static_cast<double>(values.size());
  for (const double value : values) result.value += value / n;
  double squares = 0.0;
  for (const auto& group : groups) {
    double sum = 0.0;
    for (const std::size_t i : group) sum += values[i] - result.value;
    squares += sum * sum;
  }
  const auto count = static_cast<double>(groups.size());
  result.standard_error = count > 1.0 ? std::sqrt(squares * count / (count - 1.0)) / n : 0.0;
  return result;
}

/// Of what is true or not. Where all agree their spread is no measure of chance: then as if half a toss were otherwise.
ScoreValue share_value(const std::vector<double>& values, const std::vector<std::vector<std::size_t>>& groups) {
  ScoreValue result = mean_value(values, groups);
  const auto count = static_cast<double>(groups.size());
  if (const auto [low, high] = std::ranges::minmax(values); count > 1.0 && low == high)
    result.standard_error = std::sqrt(0.5 * (count + 0.5) / count) / (count + 1.0);
  return result;
}

ScoreValue quantile_value(const std::vector<double>& values, const std::vector<std::vector<std::size_t>>& groups,
                          double q, core::RandomStream stream) {
  ScoreValue result{quantile(values, q), 0.0};
  double sum = 0.0, squares = 0.0;
  for (int k = 0; k < kResamples; ++k) {
    std::vector<double> drawn;
    for (std::size_t i = 0; i < groups.size(); ++i)
      for (const std::size_t at : groups[stream.uniform_below(groups.size())]) drawn.push_back(values[at]);
    const double each = quantile(std::move(drawn), q);
    sum += each;
    squares += each * each;
  }
  const double mean = sum / kResamples;
  result.standard_error = std::sqrt(std::max(0.0, (squares - kResamples * mean * mean) / (kResamples - 1)));
  return result;
}

std::vector<ReliabilityRow> reliability_of(std::span<const ScoredToss> tosses) {
  std::vector<ReliabilityRow> rows;
  for (std::size_t bin = 0; bin + 1 < kBins.size(); ++bin) {
    ReliabilityRow row{kBins[bin], kBins[bin + 1], 0, 0.0, 0.0};
    const bool last = bin + 2 == kBins.size();
    for (const ScoredToss& toss : tosses) {
      for (std::size_t side = 0; side < kSides.size(); ++side) {
        const double p = toss.side_probabilities[side];
        if (p < row.low || (p >= row.high && !last)) continue;
        ++row.n;
        row.mean += p;
        row.observed += side == toss.true_side ? 1.0 : 0.0;
      }
    }
    if (row.n == 0) continue;
    row.mean /= row.n;
    row.observed /= row.n;
    rows.push_back(row);
  }
  return rows;
}

nlohmann::ordered_json to_json(const ScoreValue& score) {
  return {{"value", score.value}, {"standard_error", score.standard_error}};
}

}  // namespace

ScoredToss score_toss(const simulation::RecordedMotion& motion, const simulation::RecordedRest& rest,
                      const simulation::MotionForecast& forecast, double radius_of_gyration) {
  PRESCENE_CHECK(!forecast.ends.empty() && rest.last < motion.frames.size() && rest.first <= rest.last);
  ScoredToss toss;
  toss.name = motion.name;
  toss.moving = forecast.moving;
  toss.lost = forecast.lost;
  toss.rest_time = motion.frames[rest.first].time - motion.frames.front().time;
  const auto resting = static_cast<double>(rest.last - rest.first + 1);
  for (std::size_t i = rest.first; i <= rest.last; ++i)
    toss.true_place += motion.frames[i].X_WO.translation.head<2>() / resting;
  toss.true_side = static_cast<std::size_t>(
      geometry::face_up(motion.frames[rest.first + (rest.last - rest.first) / 2].X_WO.rotation));
  std::array<int, kSides.size()> counts{};
  std::vector<int> sides;
  std::vector<Eigen::Vector2d> places;
  for (const geometry::Pose& X_WO : forecast.ends) {
    const auto side = static_cast<std::size_t>(geometry::face_up(X_WO.rotation));
    ++counts[side];
    sides.push_back(static_cast<int>(side));
    places.emplace_back(X_WO.translation.head<2>());
  }
  const std::vector<double> probabilities = probabilities_of(counts);
  std::ranges::copy(probabilities, toss.side_probabilities.begin());
  toss.brier = brier_score(probabilities, static_cast<int>(toss.true_side));
  toss.log_score = log_score(probabilities, static_cast<int>(toss.true_side));
  const int likeliest = mode_of(probabilities);
  std::vector<double> x, y;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (sides[i] != likeliest) continue;
    x.push_back(places[i].x());
    y.push_back(places[i].y());
  }
  toss.place = {quantile(x, 0.5), quantile(y, 0.5)};
  toss.region_mass = region_mass(density_of(std::move(places), sides, kKernelScale, kKernelFloor * radius_of_gyration),
                                 toss.true_place);
  return toss;
}

TossScores scores_of(std::span<const ScoredToss> tosses, core::RandomStream stream) {
  PRESCENE_CHECK(!tosses.empty());
  const auto groups = groups_of(tosses);
  TossScores scores;
  scores.n = static_cast<int>(tosses.size());
  scores.independent = static_cast<int>(groups.size());
  const auto of_each = [&](const auto& of) {
    std::vector<double> values;
    for (const ScoredToss& toss : tosses) values.push_back(of(toss));
    return values;
  };
  const auto mean_of_each = [&](const auto& of) { return mean_value(of_each(of), groups); };
  const auto share_of = [&](const auto& of) { return share_value(of_each(of), groups); };
  scores.right_side = share_of([](const ScoredToss& toss) {
    return mode_of(toss.side_probabilities) == static_cast<int>(toss.true_side) ? 1.0 : 0.0;
  });
  scores.brier = mean_of_each([](const ScoredToss& toss) { return toss.brier; });
  scores.log_score = mean_of_each([](const ScoredToss& toss) { return toss.log_score; });
  for (Eigen::Index axis = 0; axis < 2; ++axis)
    scores.mean_error[static_cast<std::size_t>(axis)] =
        mean_of_each([axis](const ScoredToss& toss) { return toss.true_place[axis] - toss.place[axis]; });
  for (std::size_t i = 0; i < kLevels.size(); ++i) {
    const double level = kLevels[i];
    scores.coverage[i] = {level,
                          share_of([level](const ScoredToss& toss) { return toss.region_mass < level ? 1.0 : 0.0; })};
  }
  std::vector<double> errors;
  for (const ScoredToss& toss : tosses) errors.push_back(toss.error());
  scores.median_error = quantile_value(errors, groups, 0.5, stream.at(0));
  scores.p90_error = quantile_value(errors, groups, 0.9, stream.at(1));
  scores.reliability = reliability_of(tosses);
  return scores;
}

nlohmann::ordered_json to_json(const TossScores& scores) {
  nlohmann::ordered_json json;
  json["n"] = scores.n;
  json["independent"] = scores.independent;
  json["right_side"] = to_json(scores.right_side);
  json["brier"] = to_json(scores.brier);
  json["log_score"] = to_json(scores.log_score);
  json["median_error"] = to_json(scores.median_error);
  json["p90_error"] = to_json(scores.p90_error);
  json["mean_error"] = {{"x", to_json(scores.mean_error[0])}, {"y", to_json(scores.mean_error[1])}};
  json["coverage"] = nlohmann::ordered_json::array();
  for (const CoverageValue& each : scores.coverage)
    json["coverage"].push_back(
        {{"level", each.level}, {"held", each.held.value}, {"standard_error", each.held.standard_error}});
  json["reliability"] = nlohmann::ordered_json::array();
  for (const ReliabilityRow& row : scores.reliability)
    json["reliability"].push_back(
        {{"low", row.low}, {"high", row.high}, {"n", row.n}, {"mean", row.mean}, {"observed", row.observed}});
  return json;
}

nlohmann::ordered_json to_json(const ScoredToss& toss) {
  nlohmann::ordered_json json;
  json["toss"] = toss.name;
  if (toss.fold >= 0) json["fold"] = toss.fold;
  json["side"] = kSides[toss.true_side];
  for (std::size_t side = 0; side < kSides.size(); ++side)
    json["probabilities"][kSides[side]] = toss.side_probabilities[side];
  json["brier"] = toss.brier;
  json["place"] = {toss.place.x(), toss.place.y()};
  json["true_place"] = {toss.true_place.x(), toss.true_place.y()};
  json["error"] = toss.error();
  json["region_mass"] = toss.region_mass;
  json["rest_time"] = toss.rest_time;
  if (toss.moving > 0) json["moving"] = toss.moving;
  if (toss.lost > 0) json["lost"] = toss.lost;
  return json;
}

}  // namespace prescene::service
