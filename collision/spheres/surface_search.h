// SPDX-License-Identifier: Apache-2.0
// Nearest places on the triangles of a mesh, and how often they wind around a point. In double precision: what a sphere
// may grow to is decided here.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "prescene/collision/mesh.h"
#include "swept_sphere.h"

namespace prescene::collision {

/// The place on the triangle a, b, c nearest to p [Ericson 2005, section 5.1.5]; of a triangle without area that on the
/// segment or point that is left of it.
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                    const Eigen::Vector3d& c);

class SurfaceSearch {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  struct Nearest {
    double squared_distance = std::numeric_limits<double>::infinity();
    std::uint32_t triangle = kNone;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
  };

  /// Copies the corners. At least one triangle (checked). Deterministic.
  SurfaceSearch(std::span<const Vector3f> vertices, std::span<const TriangleIndices> triangles);

  const Eigen::AlignedBox3d& box() const { return root_box_; }
  /// The nearest place whose squared distance is less than `bound`; no triangle when there is none. No allocation.
  Nearest nearest(const Eigen::Vector3d& q, double bound = std::numeric_limits<double>::infinity()) const;
  /// Whether the squared distance is less than `bound`; cheaper than nearest().
  bool is_within(const Eigen::Vector3d& q, double bound) const;
  /// When the sphere first touches a triangle; SweptSphere::kNever when it does not. No allocation.
  double first_contact(const SweptSphere& sphere) const;
  /// The largest direction . p over the corners of triangles within `radius` of `centre`; minus infinity when there are
  /// none. No allocation.
  double reach_along(const Eigen::Vector3d& direction, const Eigen::Vector3d& centre, double radius) const;
  /// How often a closed, oriented surface winds around q: 1 inside of one solid, 2 where two overlap, 0 outside. The
  /// signs of shared edges agree between their triangles, so that no crossing is missed or counted twice.
  int winding(const Eigen::Vector3d& q) const;

 private:
  struct Box {
    std::array<float, 3> low;
    std::array<float, 3> high;
  };
  struct Corners {
    Eigen::Vector3d a;
    Eigen::Vector3d b;
    Eigen::Vector3d c;
    std::uint32_t triangle;
  };
  static constexpr std::size_t kLeafSize = 4;
  static constexpr std::size_t kMaxDepth = 40;

  static Eigen::AlignedBox3d aligned(const Box& box) {
    const auto corner = [](const std::array<float, 3>& p) {
      return Eigen::Vector3d(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
    };
    return {corner(box.low), corner(box.high)};
  }
  static double squared_distance(const Box& box, const Eigen::Vector3d& q) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double x = q[static_cast<Eigen::Index>(i)];
      const double off = std::max({static_cast<double>(box.low[i]) - x, x - static_cast<double>(box.high[i]), 0.0});
      sum += off * off;
    }
    return sum;
  }
  void build(std::span<const Box> boxes, std::vector<std::uint32_t>& order, std::size_t node, std::size_t begin,
             std::size_t end);
  bool is_leaf(std::size_t node) const { return node >= first_leaf_; }

  // Calls leaf(triangle) for those below boxes that enter(box) lets in, until it returns true; then returns true.
  template <class Enter, class Leaf>
  bool descend(const Enter& enter, const Leaf& leaf) const {
    std::array<std::uint32_t, kMaxDepth> stack;
    std::size_t size = 0;
    stack[size++] = 1;
    while (size > 0) {
      const std::uint32_t node = stack[--size];
      if (!enter(boxes_[node])) continue;
      if (!is_leaf(node)) {
        stack[size++] = 2 * node + 1;
        stack[size++] = 2 * node;
        continue;
      }
      const std::size_t i = node - first_leaf_;
      for (std::uint32_t k = leaf_begin_[i]; k < leaf_begin_[i + 1]; ++k) {
        if (leaf(corners_[k])) return true;
      }
    }
    return false;
  }

  std::vector<Box> boxes_;  // Index 1 is the root, 2n and 2n + 1 are the children of n.
  std::vector<Corners> corners_;
  std::vector<std::uint32_t> leaf_begin_;  // One more than there are leaves.
  std::size_t first_leaf_ = 1;
  Eigen::AlignedBox3d root_box_;
};

}  // namespace prescene::collision
