// SPDX-License-Identifier: Apache-2.0
#include "uncertain_lanes.h"

#include <algorithm>
#include <cmath>

namespace prescene::collision {

Swelling::Swelling(const RelativeUncertainty& between, const SphereTree& b) : X_AB(between.X_AB()) {
  for (std::size_t i = 0; i < 3; ++i) pivot[i] = static_cast<float>(between.pivot()[static_cast<Eigen::Index>(i)]);
  const double middle = (X_AB * b.root().centre - Vector3f(pivot[0], pivot[1], pivot[2])).cast<double>().norm();
  const auto radius = static_cast<double>(b.root().radius);
  // The root mean square of the nearest and the farthest distance.
  const double nearest = std::max(0.0, middle - radius);
  const double e = std::sqrt(0.5 * (nearest * nearest + (middle + radius) * (middle + radius)));
  const RelativeUncertainty::Growth growth = between.growth();
  // Doubles rounded to floats are off by 6e-8 of themselves, the kernels' sums by a few times that.
  const auto up = [](double x) { return static_cast<float>(x * (1.0 + 1e-6)); };
  // The tangent of sqrt(w) at e^2 is e / 2 + w / (2 e).
  remainder = up(growth.remainder + 0.5 * growth.remainder_slope * e);
  remainder_slope = up(0.5 * growth.remainder_slope / e);
  const double at_e = between.deviation_bound(e);
  const double slope = at_e > 0.0 ? 0.5 * (growth.quadratic + 0.5 * growth.linear / e) / at_e : 0.0;
  deviation = up(at_e - slope * e * e);
  deviation_slope = up(slope);
  region_radius = up(between.region_radius());
  ball_radius = up(between.ball_radius());
  std::size_t index = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) factor[index++] = static_cast<float>(between.factor()(i, j));
  }
}

void DescentStack::reserve(const SphereTree& tree_a, const SphereTree& tree_b) {
  const std::size_t levels = static_cast<std::size_t>(tree_a.depth()) + static_cast<std::size_t>(tree_b.depth());
  const std::size_t most = levels * tree_a.branching() * tree_b.branching() + 1 + kPairLanes;
  if (a.size() >= most) return;
  a.resize(most);
  b.resize(most);
  gap.resize(most);
}

}  // namespace prescene::collision
