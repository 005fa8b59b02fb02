// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/importance_sampling.h"

#include <algorithm>
#include <cmath>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::service {
namespace {

using geometry::Matrix6d;
using geometry::Vector6d;

constexpr int kFreedom = 6;  // of the Student distribution; even, so that chi-squared draws are sums of exponentials
constexpr double kSmallestEffective = 20.0;  // samples that a fit may rest on

/// Draws from a Student distribution about the proposal, with its log density up to a constant that depends on the
/// covariance alone.
class Student {
 public:
  explicit Student(const ImportanceProposal& proposal) : mean_(proposal.mean), root_(proposal.covariance) {}

  Vector6d draw(core::RandomStream& stream, double* log_density) const {
    Vector6d z;
    for (int i = 0; i < 6; ++i) z[i] = stream.normal();
    double exponentials = 0.0;
    for (int i = 0; i < kFreedom / 2; ++i) exponentials -= std::log(stream.uniform());
    z /= std::sqrt(2.0 * exponentials / kFreedom);
    *log_density = -0.5 * (kFreedom + 6) * std::log1p(z.squaredNorm() / kFreedom);
    return mean_ + root_.factor().triangularView<Eigen::Lower>() * z;
  }

 private:
  Vector6d mean_;
  geometry::Cholesky6 root_;
};

/// Weights of the samples to the power `power`, and what they say of mean and covariance.
void weigh(const std::vector<double>& log_weights, double power, ImportanceSamples* samples) {
  const double largest = *std::max_element(log_weights.begin(), log_weights.end());
  double sum = 0.0;
  samples->weights.resize(log_weights.size());
  for (std::size_t i = 0; i < log_weights.size(); ++i)
    sum += samples->weights[i] = std::exp(power * (log_weights[i] - largest));
  double squares = 0.0;
  samples->fitted = {Vector6d::Zero(), Matrix6d::Zero()};
  for (std::size_t i = 0; i < log_weights.size(); ++i) {
    samples->weights[i] /= sum;
    squares += samples->weights[i] * samples->weights[i];
    samples->fitted.mean += samples->weights[i] * samples->points[i];
  }
  for (std::size_t i = 0; i < log_weights.size(); ++i) {
    const Vector6d d = samples->points[i] - samples->fitted.mean;
    samples->fitted.covariance += samples->weights[i] * d * d.transpose();
  }
  samples->effective = 1.0 / squares;
}

}  // namespace

double ImportanceSamples::mass_above(double log_density) const {
  double mass = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i)
    if (log_densities[i] > log_density) mass += weights[i];
  return mass;
}

ImportanceSamples sample_by_importance(const LogDensity& target, const ImportanceProposal& start,
                                       const ImportanceOptions& options, core::RandomStream& stream) {
  ImportanceSamples samples;
  ImportanceProposal proposal = start;
  std::vector<double> log_weights;
  for (int round = 0; round <= options.rounds; ++round) {
    const bool last = round == options.rounds;
    const auto count = static_cast<std::size_t>(last ? options.samples : options.samples_a_round);
    samples.points.resize(count);
    samples.log_densities.resize(count);
    log_weights.resize(count);
    const Student student(proposal);
    for (std::size_t i = 0; i < count; ++i) samples.points[i] = student.draw(stream, &log_weights[i]);
    target(samples.points, samples.log_densities);
    for (std::size_t i = 0; i < count; ++i) log_weights[i] = samples.log_densities[i] - log_weights[i];
    weigh(log_weights, 1.0, &samples);
    if (last) break;
    // Weights that rest on a few samples are flattened until enough of them count.
    for (double power = 0.7; samples.effective < kSmallestEffective && power > 0.01; power *= 0.7)
      weigh(log_weights, power, &samples);
    proposal = samples.fitted;
    proposal.covariance *= options.widening * options.widening;
  }
  return samples;
}

}  // namespace prescene::service
