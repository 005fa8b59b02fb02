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
  if (belief::effective_sample_size(particles) >= options.min_effective_share * count) return false;
  const auto best = static_cast<int>(
      std::max_element(particles.begin(), particles.end(),
                       [](const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; }) -
      particles.begin());
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
    if (i == previous || i == best) spread_copy(options.spread, stream, resampled.back());
    previous = i;
  }
  for (Particle& particle : resampled) particle.log_weight = -std::log(count);
  particles = std::move(resampled);
  return true;
}

}  // namespace prescene::filter
