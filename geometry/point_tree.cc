// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/point_tree.h"

#include <limits>

#include "box_tree.h"
#include "prescene/core/check.h"

namespace prescene::geometry {
namespace {

// Eight points to a leaf: smaller leaves cost more boxes, larger ones more distances (measured on 2,600 surface
// points).
constexpr std::size_t kLeafSize = 8;

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
  explicit Impl(std::span<const Vector3d> points) : tree(boxes_of(points), kLeafSize), place(points.size()) {
    ordered.reserve(points.size());
    for (const std::uint32_t i : tree.order()) {
      place[i] = static_cast<std::uint32_t>(ordered.size());
      ordered.push_back(points[i]);
    }
  }

  Nearest nearest(const Vector3d& q, std::uint32_t best, double bound) const {
    tree.search(q, bound, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const double squared = (ordered[i] - q).squaredNorm();
        if (squared < bound) {
          bound = squared;
          best = i;
        }
      }
    });
    return {tree.order()[best], bound};
  }

  BoxTree tree;
  std::vector<Vector3d> ordered;     // In the tree's order.
  std::vector<std::uint32_t> place;  // Of each original index in that order.
};

PointTree::PointTree(std::span<const Vector3d> points) : impl_(std::make_unique<Impl>(points)) {}
PointTree::~PointTree() = default;
PointTree::PointTree(PointTree&&) noexcept = default;
PointTree& PointTree::operator=(PointTree&&) noexcept = default;

std::size_t PointTree::size() const { return impl_->ordered.size(); }

PointTree::Nearest PointTree::nearest(const Vector3d& q) const {
  return impl_->nearest(q, 0, std::numeric_limits<double>::infinity());
}

PointTree::Nearest PointTree::nearest(const Vector3d& q, std::uint32_t hint) const {
  PRESCENE_CHECK(hint < size());
  const std::uint32_t place = impl_->place[hint];
  return impl_->nearest(q, place, (impl_->ordered[place] - q).squaredNorm());
}

std::span<const std::uint32_t> PointTree::order() const { return impl_->tree.order(); }

}  // namespace prescene::geometry
