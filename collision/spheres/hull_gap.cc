// SPDX-License-Identifier: Apache-2.0
#include "hull_gap.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <limits>

#include "prescene/core/check.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

// At most five points whose hull comes ever nearer to the origin.
struct Simplex {
  std::array<Vector3d, 5> points;
  std::size_t size = 0;
};

struct Face {
  unsigned subset = 0;
  Vector3d nearest = Vector3d::Zero();
  double squared = 0.0;
};

// The point of the affine hull of 1 to 4 points that is nearest to the origin, if it lies in their hull.
template <int kCount>
bool nearest_inside(const std::array<Vector3d, 4>& p, Vector3d& nearest) {
  if constexpr (kCount == 1) {
    nearest = p[0];
    return true;
  } else {
    constexpr int kEdges = kCount - 1;
    Eigen::Matrix<double, 3, kEdges> edges;
    for (int i = 0; i < kEdges; ++i) edges.col(i) = p[static_cast<std::size_t>(i + 1)] - p[0];
    const Eigen::Matrix<double, kEdges, kEdges> products = edges.transpose() * edges;
    const Eigen::Matrix<double, kEdges, 1> right = -edges.transpose() * p[0];
    const Eigen::Matrix<double, kEdges, 1> weights = products.inverse() * right;
    if (!weights.allFinite() || weights.minCoeff() < 0.0 || weights.sum() > 1.0) return false;
    nearest = p[0] + edges * weights;
    // Points almost in a line or plane give weights that mean nothing: the nearest point is normal to all edges.
    const Eigen::Matrix<double, kEdges, 1> off = edges.transpose() * nearest;
    const double scale = edges.squaredNorm();
    return off.cwiseAbs().maxCoeff() <= 1e-9 * scale && (kCount < 4 || nearest.squaredNorm() <= 1e-18 * scale);
  }
}

bool nearest_inside(const Simplex& simplex, unsigned subset, Vector3d& nearest) {
  std::array<Vector3d, 4> p;
  std::size_t count = 0;
  for (std::size_t i = 0; i < simplex.size; ++i) {
    if (((subset >> i) & 1U) != 0) p[count++] = simplex.points[i];
  }
  switch (count) {
    case 1:
      return nearest_inside<1>(p, nearest);
    case 2:
      return nearest_inside<2>(p, nearest);
    case 3:
      return nearest_inside<3>(p, nearest);
    default:
      return nearest_inside<4>(p, nearest);
  }
}

// Keeps the smallest face with the point nearest to the origin, and returns that point.
Vector3d reduce(Simplex& simplex) {
  Face best;
  bool found = false;
  for (unsigned subset = 1; subset < (1U << simplex.size); ++subset) {
    Vector3d nearest;
    if (std::popcount(subset) > 4 || !nearest_inside(simplex, subset, nearest)) continue;
    if (!found || nearest.squaredNorm() < best.squared) best = {subset, nearest, nearest.squaredNorm()};
    found = true;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < simplex.size; ++i) {
    if (((best.subset >> i) & 1U) != 0) simplex.points[kept++] = simplex.points[i];
  }
  simplex.size = kept;
  return best.nearest;
}

}  // namespace

HullGap hull_gap(const Vector3d& p, std::span<const PackedSphere> spheres, std::optional<double> decide) {
  PRESCENE_CHECK(!spheres.empty());
  constexpr int kMostSteps = 200;
  constexpr double kTolerance = 1e-6;
  // The nearest sphere bounds the gap without the roundings of what follows.
  double nearest = std::numeric_limits<double>::infinity();
  for (const PackedSphere& sphere : spheres)
    nearest = std::min(nearest, (p - sphere.centre.cast<double>()).norm() - static_cast<double>(sphere.radius));
  nearest = std::max(nearest, 0.0);
  if (decide && nearest <= *decide) return {0.0, nearest};
  Vector3d direction = p - spheres[0].centre.cast<double>();
  HullGap gap{0.0, std::numeric_limits<double>::infinity()};
  Simplex simplex;
  for (int i = 0; i < kMostSteps; ++i) {
    const double length = direction.norm();
    if (length > 0.0) direction /= length;
    double farthest = -std::numeric_limits<double>::infinity();
    const PackedSphere* support = nullptr;
    for (const PackedSphere& sphere : spheres) {
      const double reach = direction.dot(sphere.centre.cast<double>()) + static_cast<double>(sphere.radius);
      if (reach > farthest) {
        farthest = reach;
        support = &sphere;
      }
    }
    gap.low = std::max(gap.low, direction.dot(p) - farthest);
    const Vector3d point = support->centre.cast<double>() + static_cast<double>(support->radius) * direction;
    simplex.points[simplex.size++] = p - point;
    direction = reduce(simplex);
    const double before = gap.high;
    gap.high = std::min(gap.high, direction.norm());
    const double close = kTolerance * (p - support->centre.cast<double>()).norm();
    const bool stuck = simplex.size > 3 || gap.high >= before;
    const bool decided = decide && (gap.high <= *decide || gap.low > *decide);
    if (decided || stuck || gap.high - gap.low <= close) break;
  }
  gap.high = std::min(gap.high, nearest);
  return gap;
}

}  // namespace prescene::collision
