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
  least_trace = static_cast<float>(between.least_trace());
  const Eigen::Matrix3d rotation = between.covariance().topLeftCorner<3, 3>();
  const Eigen::Matrix3d growing = rotation.trace() * Eigen::Matrix3d::Identity() - rotation;
  for (int i = 0; i < 9; ++i) trace_growth[static_cast<std::size_t>(i)] = static_cast<float>(growing(i / 3, i % 3));
  std::size_t index = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) factor[index++] = static_cast<float>(between.factor()(i, j));
  }
}

bool roots_may_meet(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between, double deviations) {
  const Vector3f centre_b = between.X_AB() * b.root().centre;
  const auto radius_b = static_cast<double>(b.root().radius);
  const double farthest = (centre_b.cast<double>() - between.pivot()).norm() + radius_b;
  const double moved = deviations * between.deviation_bound(farthest) + between.remainder(farthest);
  // Bounding spheres are rounded to floats.
  const double reach = (static_cast<double>(a.root().radius) + radius_b + moved) * (1.0 + 1e-6);
  return (centre_b - a.root().centre).cast<double>().squaredNorm() <= reach * reach;
}

void DescentStack::Pairs::reserve(std::size_t size) {
  if (a.size() >= size) return;
  const std::size_t enough = size + size / 2;
  a.resize(enough);
  b.resize(enough);
  gap.resize(enough);
}

}  // namespace prescene::collision
