// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/resample.h"

#include <algorithm>
#include <cmath>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {
namespace {

using belief::Matrix12d;
using belief::Particle;
using Vector12d = Eigen::Matrix<double, 12, 1>;

constexpr double kNegligible = 12.0;  // nats below the best; a particle so light says nothing any more

/// Moves a copy within its Gaussian and narrows what is left, so that mean and covariance over many copies stay.
void spread_copy(double share, core::RandomStream& stream, Particle& particle) {
  const geometry::SymmetricEigen eigen = geometry::symmetric_eigen(particle.covariance);
  Vector12d d = Vector12d::Zero();
  for (int i = 0; i < 12; ++i)
    d += stream.normal() * std::sqrt(share * std::max(0.0, eigen.values[i])) * eigen.vectors.col(i);
  particle.X_WO = geometry::normalized(geometry::box_plus(particle.X_WO, d.head<6>()));
  particle.V_WO.angular += d.segment<3>(6);
  particle.V_WO.linear += d.tail<3>();
  particle.covariance *= 1.0 - share;
}

/// What rests needs few particles, and those that woke for nothing would have to make up for it once it does move: the
/// negligible ones become copies of the best, which share its weight.
void replace_negligible(std::size_t best, std::vector<Particle>& particles) {
  const Particle original = particles[best];
  std::vector<std::size_t> replaced;
  for (std::size_t i = 0; i < particles.size(); ++i)
    if (particles[i].log_weight < original.log_weight - kNegligible) replaced.push_back(i);
  if (replaced.empty()) return;
  for (const std::size_t i : replaced) particles[i] = original;
  replaced.push_back(best);
  const double each = original.log_weight - std::log(static_cast<double>(replaced.size()));
  for (const std::size_t i : replaced) particles[i].log_weight = each;
  belief::normalize(particles);
}

}  // namespace

std::vector<int> systematic_indices(const std::vector<Particle>& particles, double u) {
  const auto count = static_cast<double>(particles.size());
  std::vector<int> chosen;
  double sum = 0.0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    sum += std::exp(particles[i].log_weight);
    // Rounding may leave the sum short of one: the last particle takes what is left over.
    while (next < particles.size() && ((static_cast<double>(next) + u) / count < sum || i + 1 == particles.size())) {
      chosen.push_back(static_cast<int>(i));
      ++next;
    }
  }
  return chosen;
}

bool resample(const ResampleOptions& options, core::RandomStream stream, std::vector<Particle>& particles) {
  if (particles.size() < 2) return false;
  const auto count = static_cast<double>(particles.size());
  const auto best = static_cast<int>(
      std::max_element(particles.begin(), particles.end(),
                       [](const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; }) -
      particles.begin());
  if (particles[static_cast<std::size_t>(best)].mode == belief::MotionMode::kResting)
    replace_negligible(static_cast<std::size_t>(best), particles);
  if (belief::effective_sample_size(particles) >= options.min_effective_share * count) return false;
  std::vector<int> chosen = systematic_indices(particles, stream.uniform());
  // The best comes first, once; its place among the chosen is taken from its own copies.
  const auto place = std::find(chosen.begin(), chosen.end(), best);
  if (place != chosen.end())
    chosen.erase(place);
  else
    chosen.pop_back();
  std::vector<Particle> resampled;
  resampled.push_back(particles[static_cast<std::size_t>(best)]);
  int previous = best;
  for (const int i : chosen) {
    resampled.push_back(particles[static_cast<std::size_t>(i)]);
    // Copies of what rests stay alike: nothing would part them again, and one comparison with a frame serves all.
    const bool is_copy = i == previous || i == best;
    if (is_copy && resampled.back().mode != belief::MotionMode::kResting)
      spread_copy(options.spread, stream, resampled.back());
    previous = i;
  }
  for (Particle& particle : resampled) particle.log_weight = -std::log(count);
  particles = std::move(resampled);
  return true;
}

}  // namespace prescene::filter
