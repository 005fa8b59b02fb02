// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/forecast_scores.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "prescene/core/check.h"

namespace prescene::service {

double brier_score(std::span<const double> probabilities, int truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < probabilities.size(); ++i) {
    const double error = probabilities[i] - (static_cast<int>(i) == truth ? 1.0 : 0.0);
    sum += error * error;
  }
  return sum;
}

double log_score(std::span<const double> probabilities, int truth, double floor) {
  return std::log(std::max(floor, probabilities[static_cast<std::size_t>(truth)]));
}

int mode_of(std::span<const double> probabilities) {
  return static_cast<int>(std::max_element(probabilities.begin(), probabilities.end()) - probabilities.begin());
}

std::vector<double> probabilities_of(std::span<const int> counts, double prior) {
  const double n = std::accumulate(counts.begin(), counts.end(), 0.0) + prior * static_cast<double>(counts.size());
  std::vector<double> probabilities;
  for (const int count : counts) probabilities.push_back((count + prior) / n);
  return probabilities;
}

PlaneDensity density_of(std::vector<Eigen::Vector2d> samples, std::span<const int> groups, double scale, double floor) {
  PRESCENE_CHECK(!samples.empty() && samples.size() == groups.size());
  struct Moments {
    int count = 0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  };
  std::map<int, Moments> moments;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    Moments& m = moments[groups[i]];
    ++m.count;
    m.sum += samples[i];
  }
  Eigen::Matrix2d within = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Moments& m = moments[groups[i]];
    const Eigen::Vector2d d = samples[i] - m.sum / m.count;
    within += d * d.transpose();
  }
  const auto n = static_cast<double>(samples.size());
  within /= std::max(1.0, n - static_cast<double>(moments.size()));
  PlaneDensity density;
  density.covariance = scale * scale * std::pow(n, -1.0 / 3.0) * within + floor * floor * Eigen::Matrix2d::Identity();
  density.samples = std::move(samples);
  return density;
}

double region_mass(const PlaneDensity& density, const Eigen::Vector2d& place) {
  const Eigen::Matrix2d information = density.covariance.inverse();
  const Eigen::Matrix2d root = density.covariance.llt().matrixL();
  const auto height = [&](const Eigen::Vector2d& at) {
    double sum = 0.0;
    for (const Eigen::Vector2d& s : density.samples) sum += std::exp(-0.5 * (at - s).dot(information * (at - s)));
    return sum;
  };
  // Each kernel's mass as points of equal weight: rings at the mid quantiles of the radius, turned against each other.
  constexpr int kRings = 4;
  constexpr int kSpokes = 6;
  const double at_place = height(place);
  int higher = 0;
  for (const Eigen::Vector2d& s : density.samples) {
    for (int r = 0; r < kRings; ++r) {
      const double radius = std::sqrt(-2.0 * std::log(1.0 - (r + 0.5) / kRings));
      for (int k = 0; k < kSpokes; ++k) {
        const double angle = 2.0 * std::numbers::pi * (k + 0.5 * (r % 2)) / kSpokes;
        if (height(s + root * Eigen::Vector2d(radius * std::cos(angle), radius * std::sin(angle))) > at_place) ++higher;
      }
    }
  }
  return static_cast<double>(higher) / static_cast<double>(kRings * kSpokes * density.samples.size());
}

double energy_score(std::span<const Eigen::Vector2d> samples, const Eigen::Vector2d& place) {
  PRESCENE_CHECK(!samples.empty());
  double to_place = 0.0;
  double to_each_other = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    to_place += (samples[i] - place).norm();
    for (std::size_t k = 0; k < i; ++k) to_each_other += 2.0 * (samples[i] - samples[k]).norm();
  }
  const auto n = static_cast<double>(samples.size());
  // Pairs of different samples only, so that few samples are not at an advantage.
  return to_place / n - (n > 1.0 ? 0.5 * to_each_other / (n * (n - 1.0)) : 0.0);
}

double quantile(std::vector<double> values, double q) {
  PRESCENE_CHECK(!values.empty());
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (at - static_cast<double>(low)) * (values[high] - values[low]);
}

}  // namespace prescene::service
