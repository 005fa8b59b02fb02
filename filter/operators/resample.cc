// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/resample.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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
void replace_negligible(std::size_t best, std::vector<Particle>& particles, std::vector<std::size_t>* sources) {
  const Particle original = particles[best];
  std::vector<std::size_t> replaced;
  for (std::size_t i = 0; i < particles.size(); ++i)
    if (particles[i].log_weight < original.log_weight - kNegligible) replaced.push_back(i);
  if (replaced.empty()) return;
  for (const std::size_t i : replaced) {
    particles[i] = original;
    if (sources != nullptr) (*sources)[i] = best;
  }
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

bool resample(const ResampleOptions& options, core::RandomStream stream, std::vector<Particle>& particles,
              std::vector<std::size_t>* sources) {
  if (sources != nullptr) {
    sources->resize(particles.size());
    std::iota(sources->begin(), sources->end(), std::size_t{0});
  }
  if (particles.size() < 2) return false;
  const auto count = static_cast<double>(particles.size());
  const auto best = static_cast<int>(
      std::max_element(particles.begin(), particles.end(),
                       [](const Particle& a, const Particle& b) { return a.log_weight < b.log_weight; }) -
      particles.begin());
  if (particles[static_cast<std::size_t>(best)].mode == belief::MotionMode::kResting)
    replace_negligible(static_cast<std::size_t>(best), particles, sources);
  if (belief::effective_sample_size(particles) >= options.min_effective_share * count) return false;
  std::vector<int> chosen = systematic_indices(particles, stream.uniform());
  // The best comes first, once; its place among the chosen is taken from its own copies.
  const auto place = std::find(chosen.begin(), chosen.end(), best);
  if (place != chosen.end())
    chosen.erase(place);
  else
    chosen.pop_back();
  chosen.insert(chosen.begin(), best);
  const std::vector<std::size_t> from(chosen.begin(), chosen.end());
  copy_from(options, stream, from, particles);
  for (Particle& particle : particles) particle.log_weight = -std::log(count);
  if (sources == nullptr) return true;
  std::vector<std::size_t> through;
  for (const std::size_t i : from) through.push_back((*sources)[i]);
  *sources = std::move(through);
  return true;
}

void copy_from(const ResampleOptions& options, core::RandomStream stream, const std::vector<std::size_t>& sources,
               std::vector<Particle>& particles) {
  std::vector<Particle> copies;
  for (std::size_t k = 0; k < sources.size(); ++k) {
    copies.push_back(particles[sources[k]]);
    // Copies of what rests stay alike: nothing would part them again, and one comparison with a frame serves all.
    const bool is_copy = k > 0 && (sources[k] == sources[k - 1] || sources[k] == sources.front());
    if (is_copy && copies.back().mode != belief::MotionMode::kResting)
      spread_copy(options.spread, stream, copies.back());
  }
  particles = std::move(copies);
}

}  // namespace prescene::filter
