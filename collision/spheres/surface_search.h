// SPDX-License-Identifier: Apache-2.0
// Nearest places on triangles, and how often they wind around a point. In double precision: what a sphere may grow to
// is decided here.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <limits>
#include <span>

#include "prescene/collision/mesh.h"
#include "prescene/collision/point_queries.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::collision {

/// The place on the triangle a, b, c nearest to p [Ericson 2005, section 5.1.5]; of a triangle without area that on the
/// segment or point that is left of it.
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c);

class SurfaceSearch {
 public:
  static constexpr std::uint32_t kNone = kNoTriangle;
  struct Nearest {
    double squared_distance = std::numeric_limits<double>::infinity();
    std::uint32_t triangle = kNone;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
  };

  /// Copies the triangles, which are those of a mesh (checked).
  SurfaceSearch(std::span<const Vector3f> vertices, std::span<const TriangleIndices> triangles);

  const Eigen::AlignedBox3d& box() const { return box_; }
  /// The nearest place whose squared distance is less than `bound`; no triangle when there is none. No allocation.
  Nearest nearest(const Eigen::Vector3d& q, double bound = std::numeric_limits<double>::infinity()) const;
  /// As winding_number().
  int winding(const Eigen::Vector3d& q) const { return winding_number(tree_, q); }

 private:
  TriangleTree tree_;
  Eigen::AlignedBox3d box_;
};

}  // namespace prescene::collision
