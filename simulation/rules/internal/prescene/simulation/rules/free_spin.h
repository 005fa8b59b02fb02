// SPDX-License-Identifier: Apache-2.0
// Torque-free rotation of a rigid body, for steppers of any precision.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

namespace prescene::simulation {

/// A step of free rotation is four turns, each by a rotation vector that is these rates times the angular momentum L:
///   - about_least, about_most, about_least: in the body's principal axes, each with L as seen from the axes turned so
///     far;
///   - about_momentum: in the world's axes.
///
/// L is to be carried in the body's axes: what the world's lose by rounding is much of a slender body's spin.
///
/// The energy is split into that of a body whose three moments are the middle one, which turns about L, and what is
/// left about the axes of the least and of the greatest moment. Each part turns exactly, so L stays, and the energy
/// sways a little without growing (a symplectic splitting, of those compared in [Fasso 2003] the most exact). A body
/// with two equal moments turns exactly, however slender and fast it is.
struct SpinRates {
  Eigen::Vector3d about_least = Eigen::Vector3d::Zero();  ///< rad / (m^2/s), L of a body of 1 kg.
  Eigen::Vector3d about_most = Eigen::Vector3d::Zero();
  double about_momentum = 0.0;
};

/// Of principal moments of 1 kg (m^2, > 0), for a step of `dt` seconds.
inline SpinRates spin_rates(const Eigen::Vector3d& unit_moments, double dt) {
  const Eigen::Vector3d rates = unit_moments.cwiseInverse();
  std::array<int, 3> axes = {0, 1, 2};
  std::sort(axes.begin(), axes.end(), [&](int a, int b) { return unit_moments[a] < unit_moments[b]; });
  const auto [least, middle, most] = axes;
  SpinRates spin;
  spin.about_least[least] = 0.5 * dt * (rates[least] - rates[middle]);
  spin.about_most[most] = dt * (rates[most] - rates[middle]);
  spin.about_momentum = dt * rates[middle];
  return spin;
}

/// 1 for the principal axes that a body can't be turned about without changing the energy of a given spin; 0 where the
/// moments about the other two axes are alike (to a tenth).
inline Eigen::Vector3d uneven_axes(const Eigen::Vector3d& unit_moments) {
  constexpr double kAlike = 0.1;
  Eigen::Vector3d uneven;
  for (int k = 0; k < 3; ++k) {
    const double one = unit_moments[(k + 1) % 3], other = unit_moments[(k + 2) % 3];
    uneven[k] = std::abs(one - other) > kAlike * std::max(one, other) ? 1.0 : 0.0;
  }
  return uneven;
}

}  // namespace prescene::simulation
