// SPDX-License-Identifier: Apache-2.0
// A sphere whose centre moves along a straight line, against what surfaces are made of. Times are shares of the line;
// kNever stands for no contact.
#pragma once

#include <Eigen/Geometry>
#include <limits>

namespace prescene::collision {

struct SweptSphere {
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  SweptSphere(const Eigen::Vector3d& start, const Eigen::Vector3d& end, double its_radius)
      : from(start),
        to(end),
        move(end - start),
        radius(its_radius),
        reach(radius + 8.0 * std::numeric_limits<double>::epsilon() * (from.norm() + to.norm() + radius)) {}

  /// First contact with a segment; 0 when it touches at the start.
  double meets_segment(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const;
  /// First contact with a triangle, which may be one without area.
  double meets_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) const;
  /// When the box about it first overlaps `box`: not later than the sphere touches anything inside.
  double enters(const Eigen::AlignedBox3d& box) const;

  Eigen::Vector3d from;
  Eigen::Vector3d to;
  Eigen::Vector3d move;
  double radius;
  double reach;  ///< The radius and what rounding does to places on the way.
};

}  // namespace prescene::collision
