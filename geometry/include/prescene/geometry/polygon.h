// SPDX-License-Identifier: Apache-2.0
// Convex polygons in the plane.
//
//   const std::vector<Vector2d> corners = convex_polygon(points);
//   const double margin = distance_inside(corners, p);  // < 0: outside
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace prescene::geometry {

using Vector2d = Eigen::Vector2d;

/// Corners of the convex hull, counter-clockwise from the leftmost, of several the lowest [Andrew 1979]. Points on a
/// side are no corners: of points on one line there are two corners, of coincident points one, of no points none.
std::vector<Vector2d> convex_polygon(std::vector<Vector2d> points);

/// The same without allocation: sorts `points`, writes to the front of `corners`, which has room for twice as many, and
/// returns the number of corners.
std::size_t convex_polygon(std::span<Vector2d> points, std::span<Vector2d> corners);

/// Signed distance of `p` from the nearest line through a side of a convex polygon given counter-clockwise: > 0 inside,
/// where it is that from the nearest side. Minus infinity for fewer than three corners: they have no inside.
double distance_inside(std::span<const Vector2d> corners, const Vector2d& p);

/// Distance of `p` from a convex polygon given counter-clockwise, 0 inside. One corner is a point, two are a segment;
/// of none it is infinite.
double distance_outside(std::span<const Vector2d> corners, const Vector2d& p);

}  // namespace prescene::geometry
