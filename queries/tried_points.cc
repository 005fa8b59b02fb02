// SPDX-License-Identifier: Apache-2.0
#include "tried_points.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace prescene::queries {
namespace {

constexpr std::size_t kRanked = 160;  // points whose neighbours are looked at, each of which takes a pass over all
constexpr double kOwnWeight = 1.0;    // trials that the neighbours' mean counts for

double wrapped(double value) { return value - std::floor(value); }

}  // namespace

double in_cube(const SearchOptions& options, std::size_t parameter, double value) {
  return options.periodic[parameter] ? wrapped(value) : std::clamp(value, 0.0, 1.0);
}

std::size_t TriedPoints::add(UnitPoint at, bool explored) {
  SearchPoint& point = points_.emplace_back();
  point.at = std::move(at);
  point.explored = explored;
  point.possible = runner_.possible(point.at);
  if (explored) {
    ++result_.explored;
    result_.explored_impossible += point.possible ? 0 : 1;
  }
  return points_.size() - 1;
}

bool TriedPoints::run_pending(std::vector<Pending>& pending) {
  if (over_) return false;
  std::vector<Trial> trials;
  for (const Pending& one : pending) trials.push_back({points_[one.point].at, one.scenario, false});
  std::vector<TrialEnd> ends(trials.size());
  if (!run_trials(trials, ends)) {
    // What was stopped says nothing of its points, as if they had not been chosen yet.
    points_.resize(round_.points);
    result_.explored = round_.explored;
    result_.explored_impossible = round_.impossible;
    return false;
  }
  for (std::size_t i = 0; i < pending.size(); ++i) {
    SearchPoint& point = points_[pending[i].point];
    const bool succeeded = ends[i] == TrialEnd::kSucceeds;
    if (point.trials == 0) {
      point.scenario = pending[i].scenario;
      point.first_succeeded = succeeded;
    }
    ++point.trials;
    point.successes += succeeded;
    if (point.explored && point.trials == 1) result_.explored_successes += succeeded;
  }
  pending.clear();
  round_ = {points_.size(), result_.explored, result_.explored_impossible};
  return true;
}

bool TriedPoints::run_trials(std::span<const Trial> trials, std::span<TrialEnd> ends) {
  if (over_) return false;
  if (trials.empty()) return true;
  if (runner_.enough() || !runner_.run(trials, ends)) {
    over_ = true;
    result_.stop = SearchStop::kStopped;
    return false;
  }
  result_.all_trials += static_cast<int>(trials.size());
  result_.search_trials += static_cast<int>(trials.size());
  const int most = options_.exact_trials.value_or(options_.max_trials);
  if (result_.search_trials >= most) {
    over_ = true;
    result_.stop = options_.exact_trials ? SearchStop::kExact : SearchStop::kMaxTrials;
  }
  return true;
}

double TriedPoints::distance_squared(const UnitPoint& a, const UnitPoint& b) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < dimensions_; ++i) {
    double apart = std::abs(a[i] - b[i]);
    if (options_.periodic[i]) apart = std::min(apart, 1.0 - apart);
    sum += apart * apart;
  }
  return sum;
}

double TriedPoints::reach() const {
  const auto count = static_cast<double>(std::max<std::size_t>(points_.size(), 16));
  return 0.6 * std::pow(count, -1.0 / static_cast<double>(dimensions_));
}

double TriedPoints::overall_share() const {
  return (result_.explored_successes + 0.5) / (result_.explored - result_.explored_impossible + 1.0);
}

/// The share of success that trials at the point and near it let expect.
double TriedPoints::merit(std::size_t index) const {
  const SearchPoint& own = points_[index];
  const double reach_squared = std::pow(std::max(0.02, reach()), 2);
  double successes = overall_share(), trials = 1.0;
  for (std::size_t j = 0; j < points_.size(); ++j) {
    if (j == index) continue;
    const double apart = distance_squared(own.at, points_[j].at) / reach_squared;
    if (apart > 9.0) continue;
    const double weight = std::exp(-0.5 * apart);
    // What can't be done fails, and is known for certain; but as one trial, not more.
    successes += weight * points_[j].successes;
    trials += weight * (points_[j].possible ? points_[j].trials : 1);
  }
  return (own.successes + kOwnWeight * successes / trials) / (own.trials + kOwnWeight);
}

std::vector<TriedPoints::Ranked> TriedPoints::ranked() const {
  const double overall = overall_share();
  std::vector<Ranked> order;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const SearchPoint& point = points_[i];
    if (!point.possible || point.successes == 0) continue;
    order.push_back({i, (point.successes + overall) / (point.trials + 1.0)});
  }
  const auto better = [](const Ranked& a, const Ranked& b) { return a.merit > b.merit; };
  std::stable_sort(order.begin(), order.end(), better);
  if (order.size() > kRanked) order.resize(kRanked);
  for (Ranked& one : order) one.merit = merit(one.point);
  std::stable_sort(order.begin(), order.end(), better);
  return order;
}

}  // namespace prescene::queries
