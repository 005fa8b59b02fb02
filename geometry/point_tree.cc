// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/point_tree.h"

#include <limits>

#include "box_tree.h"
#include "prescene/core/check.h"

namespace prescene::geometry {
namespace {

// Points to a leaf: smaller leaves cost more boxes, larger ones more distances (measured on 2,600 surface points).
constexpr std::size_t kLeafSize = 32;

// The points of a leaf coordinate by coordinate; places that it does not fill are infinitely far away.
struct Leaf {
  using Row = Eigen::Array<double, kLeafSize, 1>;
  Row x = Row::Constant(std::numeric_limits<double>::infinity());
  Row y = Row::Zero();
  Row z = Row::Zero();
};

std::vector<BoxTree::ItemBox> boxes_of(std::span<const Vector3d> points) {
  std::vector<BoxTree::ItemBox> boxes;
  boxes.reserve(points.size());
  for (const Vector3d& p : points) {
    PRESCENE_CHECK(p.allFinite());
    boxes.push_back({p, p});
  }
  return boxes;
}

}  // namespace

struct PointTree::Impl {
  explicit Impl(std::span<const Vector3d> given)
      : tree(boxes_of(given), kLeafSize), points(given.begin(), given.end()) {
    const std::vector<std::uint32_t>& begins = tree.leaf_begins();
    leaves.resize(begins.size() - 1);
    for (std::size_t l = 0; l < leaves.size(); ++l) {
      for (std::uint32_t i = begins[l]; i < begins[l + 1]; ++i) {
        const Vector3d& p = points[tree.order()[i]];
        const auto place = static_cast<Eigen::Index>(i - begins[l]);
        leaves[l].x[place] = p.x();
        leaves[l].y[place] = p.y();
        leaves[l].z[place] = p.z();
      }
    }
  }

  Nearest nearest(const Vector3d& q, Nearest best) const {
    tree.search(q, best.squared_distance, [&](std::size_t leaf, std::uint32_t begin) {
      const Leaf& l = leaves[leaf];
      // Summed in the tree's order.
      const Leaf::Row squared = (l.x - q.x()).square() + ((l.y - q.y()).square() + (l.z - q.z()).square());
      if (squared.minCoeff() >= best.squared_distance) return;
      Eigen::Index place = 0;
      best.squared_distance = squared.minCoeff(&place);
      best.index = tree.order()[begin + static_cast<std::uint32_t>(place)];
    });
    return best;
  }

  BoxTree tree;
  std::vector<Vector3d> points;
  std::vector<Leaf> leaves;
};

PointTree::PointTree(std::span<const Vector3d> points) : impl_(std::make_unique<Impl>(points)) {}
PointTree::~PointTree() = default;
PointTree::PointTree(PointTree&&) noexcept = default;
PointTree& PointTree::operator=(PointTree&&) noexcept = default;

std::size_t PointTree::size() const { return impl_->points.size(); }

PointTree::Nearest PointTree::nearest(const Vector3d& q) const {
  return impl_->nearest(q, {0, std::numeric_limits<double>::infinity()});
}

PointTree::Nearest PointTree::nearest(const Vector3d& q, std::uint32_t hint) const {
  PRESCENE_CHECK(hint < size());
  const Eigen::Array3d squares = (impl_->points[hint] - q).array().square();
  return impl_->nearest(q, {hint, squares[0] + (squares[1] + squares[2])});
}

std::span<const std::uint32_t> PointTree::order() const { return impl_->tree.order(); }

}  // namespace prescene::geometry
