// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/sampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace prescene::geometry {

Quaterniond uniform_rotation(const std::array<double, 3>& u) {
  const double a = std::sqrt(1.0 - u[0]);
  const double b = std::sqrt(u[0]);
  const double alpha = 2.0 * std::numbers::pi * u[1];
  const double beta = 2.0 * std::numbers::pi * u[2];
  return {b * std::cos(beta), a * std::sin(alpha), a * std::cos(alpha), b * std::sin(beta)};
}

Quaterniond uniform_rotation(core::RandomStream& stream) {
  std::array<double, 3> u;
  for (double& x : u) x = stream.uniform();
  return uniform_rotation(u);
}

Vector3d uniform_direction(const std::array<double, 2>& u) {
  const double z = 1.0 - 2.0 * u[0];
  const double radius = std::sqrt(std::max(0.0, 1.0 - z * z));
  const double angle = 2.0 * std::numbers::pi * u[1];
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

Vector3d uniform_direction(core::RandomStream& stream) {
  std::array<double, 2> u;
  for (double& x : u) x = stream.uniform();
  return uniform_direction(u);
}

Vector3d normal_vector(core::RandomStream& stream) {
  // One statement each: the order in which arguments are evaluated is the compiler's choice.
  const double x = stream.normal();
  const double y = stream.normal();
  const double z = stream.normal();
  return {x, y, z};
}

}  // namespace prescene::geometry
