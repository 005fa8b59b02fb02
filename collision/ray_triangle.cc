// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/ray_triangle.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace prescene::collision {

std::optional<ShearedRay> shear(const Ray& ray) {
  constexpr double kShortest = 1e-100;
  constexpr double kLongest = 1e100;
  if (!ray.origin.allFinite() || !ray.direction.allFinite()) return std::nullopt;
  if (ray.origin.cwiseAbs().maxCoeff() > static_cast<double>(kLargestCoordinate)) return std::nullopt;
  if (!(ray.t_min <= ray.t_max)) return std::nullopt;
  int z = 0;
  const double length = ray.direction.cwiseAbs().maxCoeff(&z);
  if (!(length >= kShortest && length <= kLongest)) return std::nullopt;
  ShearedRay sheared{};
  sheared.order = {(z + 1) % 3, (z + 2) % 3, z};
  const bool backwards = ray.direction[z] < 0.0;
  // So that triangles go round the same way.
  if (backwards) std::swap(sheared.order[0], sheared.order[1]);
  for (std::size_t k = 0; k < 3; ++k) sheared.origin[k] = ray.origin[sheared.order[k]];
  for (std::size_t k = 0; k < 2; ++k) sheared.shear[k] = ray.direction[sheared.order[k]] / ray.direction[z];
  sheared.sign = backwards ? -1.0 : 1.0;
  sheared.metres = length;
  sheared.s_min = ray.t_min * length;
  sheared.s_max = ray.t_max * length;
  return sheared;
}

std::optional<RayTriangleHit> meet(const ShearedRay& ray, const Triangle& triangle) {
  std::array<double, 3> x;
  std::array<double, 3> y;
  std::array<double, 3> z;
  for (std::size_t i = 0; i < 3; ++i) {
    z[i] = static_cast<double>(triangle[i][ray.order[2]]) - ray.origin[2];
    x[i] = (static_cast<double>(triangle[i][ray.order[0]]) - ray.origin[0]) - ray.shear[0] * z[i];
    y[i] = (static_cast<double>(triangle[i][ray.order[1]]) - ray.origin[1]) - ray.shear[1] * z[i];
  }
  const double u = x[2] * y[1] - y[2] * x[1];
  const double v = x[0] * y[2] - y[0] * x[2];
  const double w = x[1] * y[0] - y[1] * x[0];
  const double smallest = std::min(std::min(u, v), w);
  const double largest = std::max(std::max(u, v), w);
  if (smallest < 0.0 && largest > 0.0) return std::nullopt;
  const double sum = (u + v) + w;
  if (sum == 0.0) return std::nullopt;
  const double s = ray.sign * (((u * z[0] + v * z[1]) + w * z[2]) / sum);
  const double slack = kRangeSlack * std::max(std::max(std::abs(z[0]), std::abs(z[1])), std::abs(z[2]));
  if (!(s >= ray.s_min - slack && s <= ray.s_max + slack)) return std::nullopt;
  return RayTriangleHit{s, {u / sum, v / sum, w / sum}, sum > 0.0};
}

}  // namespace prescene::collision
