// SPDX-License-Identifier: Apache-2.0
// Where a ray meets one triangle, in double precision: the scalar twin of the kernel behind ray_queries.h, which gives
// the same bits.
//
// The ray is turned into the axis z by a shear and a change of the order of coordinates, the same for all triangles;
// then the signs of three areas decide [Woop et al. 2013]. The area at an edge that two triangles share is the same
// number for both but for its sign, and zero counts for both: no ray slips through between them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>

#include "prescene/collision/exact_triangles.h"

namespace prescene::collision {

/// The points origin + t direction, t_min <= t <= t_max: a ray; with t_max = 1 a segment; with t_min = -infinity a
/// line.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();     ///< m.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< Of any length but zero.
  double t_min = 0.0;
  double t_max = std::numeric_limits<double>::infinity();
};

/// A ray in coordinates in which it is simple.
struct ShearedRay {
  std::array<int, 3> order;      ///< Which coordinates are x, y and z: z is where the direction is largest.
  std::array<double, 3> origin;  ///< In that order, m.
  std::array<double, 2> shear;   ///< Of x and y per z.
  double sign;                   ///< Of the direction's z.
  double metres;                 ///< What t = 1 is along z.
  /// The range of t in metres along z.
  double s_min;
  double s_max;
};

/// Nothing for a ray that can hit nothing: with a number that is not finite (t_min and t_max may be infinite, not NaN),
/// an origin beyond kLargestCoordinate, t_min > t_max, or a direction whose largest coordinate is zero or otherwise
/// outside 1e-100 to 1e100.
std::optional<ShearedRay> shear(const Ray& ray);

/// Shares within this of the farthest corner's distance along z do not decide whether a hit is within the range of t:
/// it is what rounding does to a hit at the end of the range.
inline constexpr double kRangeSlack = 0x1p-48;

struct RayTriangleHit {
  double s;                       ///< Metres along z, in the direction of the ray.
  std::array<double, 3> weights;  ///< Of the corners; their sum is 1.
  bool front;                     ///< The ray comes from where the corners go round counter-clockwise.
};

/// Both sides count, and so do edges, corners and the ends of the range. A triangle that the ray sees as a line or a
/// point is not hit (its neighbours are), nor is one without area.
std::optional<RayTriangleHit> meet(const ShearedRay& ray, const Triangle& triangle);

}  // namespace prescene::collision
