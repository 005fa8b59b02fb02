// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/body_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "body_set.cc"
#include <hwy/foreach_target.h>
// After foreach_target.h, which includes this file once for each instruction set.
#include <hwy/highway.h>

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <limits>

#include "prescene/collision/lanes-inl.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/core/check.h"

HWY_BEFORE_NAMESPACE();
namespace prescene::collision::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Which of sixteen boxes meet `box`.
std::uint32_t meeting_lanes(const BodySet::Boxes& boxes, const WorldBox& box) {
  const HWY_CAPPED(float, 16) d;
  std::uint32_t bits = 0;
  for (std::size_t lane = 0; lane < 16; lane += hn::Lanes(d)) {
    auto meet = hn::FirstN(d, hn::Lanes(d));
    for (std::size_t k = 0; k < 3; ++k) {
      meet = hn::And(meet, hn::Le(hn::Load(d, boxes.low[k].data() + lane), hn::Set(d, box.high[k])));
      meet = hn::And(meet, hn::Ge(hn::Load(d, boxes.high[k].data() + lane), hn::Set(d, box.low[k])));
    }
    bits |= bits_of_mask(d, meet) << lane;
  }
  return bits;
}

}  // namespace prescene::collision::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace prescene::collision {

HWY_EXPORT(meeting_lanes);

namespace {

using Eigen::Vector3d;

Vector3d widened(const float* v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// About the root's box, and what a query's roundings do to coordinates there.
WorldBox world_box(const TriangleTree& tree, const geometry::Pose& X_WB) {
  constexpr double kRounding = 64.0 / 16777216.0;
  const TriangleTreeNode& root = tree.nodes()[0];
  Eigen::Matrix3d axes;  // Of the root, in columns.
  axes.row(0) = widened(root.axes_x).transpose();
  axes.row(1) = widened(root.axes_y).transpose();
  axes.row(2) = widened(root.axes_z).transpose();
  const Vector3d half = widened(root.half_extent);
  const Vector3d centre = X_WB * Vector3d(widened(root.origin) + axes * half);
  const double slack = kRounding * (static_cast<double>(tree.radius()) + X_WB.translation.lpNorm<1>());
  const Vector3d reach =
      (X_WB.rotation.toRotationMatrix() * axes).cwiseAbs() * half + Vector3d::Constant(slack + 1e-36);
  WorldBox box;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    box.low[k] = static_cast<float>(centre[axis] - reach[axis]);
    box.high[k] = static_cast<float>(centre[axis] + reach[axis]);
  }
  return box;
}

}  // namespace

core::Result<std::uint32_t> BodySet::add(std::shared_ptr<const TriangleTree> tree, const geometry::Pose& X_WB) {
  PRESCENE_CHECK(tree != nullptr);
  const auto checked = to_transform(X_WB);
  if (!checked.ok()) return checked.status().at("body " + std::to_string(size()));
  bodies_.push_back({std::move(tree), normalized(X_WB)});
  const std::uint32_t body = size() - 1;
  if (body % 16 == 0) {
    Boxes& boxes = boxes_.emplace_back();
    for (auto& low : boxes.low) low.fill(std::numeric_limits<float>::infinity());
    for (auto& high : boxes.high) high.fill(-std::numeric_limits<float>::infinity());
  }
  set_box(body);
  return body;
}

core::Status BodySet::move(std::uint32_t body, const geometry::Pose& X_WB) {
  PRESCENE_CHECK(body < size());
  const auto checked = to_transform(X_WB);
  if (!checked.ok()) return checked.status().at("body " + std::to_string(body));
  bodies_[body].X_WB = normalized(X_WB);
  set_box(body);
  return core::ok_status();
}

void BodySet::set_box(std::uint32_t body) {
  const WorldBox box = world_box(*bodies_[body].tree, bodies_[body].X_WB);
  for (std::size_t k = 0; k < 3; ++k) {
    boxes_[body / 16].low[k][body % 16] = box.low[k];
    boxes_[body / 16].high[k][body % 16] = box.high[k];
  }
}

core::Status collide_many(const TriangleTree& a, const geometry::Pose& X_WA, const BodySet& bodies,
                          std::vector<std::uint32_t>* touching, QueryScratch& scratch, QueryCounts* counts) {
  touching->clear();
  const auto checked = to_transform(X_WA);
  if (!checked.ok()) return checked.status().at("the moving body");
  const WorldBox box = world_box(a, normalized(X_WA));
  if (counts != nullptr) counts->volume_tests += bodies.size();
  for (std::size_t block = 0; block < bodies.boxes().size(); ++block) {
    for (std::uint32_t bits = HWY_DYNAMIC_DISPATCH(meeting_lanes)(bodies.boxes()[block], box); bits != 0;
         bits &= bits - 1) {
      const auto body = static_cast<std::uint32_t>(16 * block) + static_cast<std::uint32_t>(std::countr_zero(bits));
      const auto X_AB = relative_transform(X_WA, bodies.pose(body));
      if (!X_AB.ok()) {
        touching->clear();
        return X_AB.status().at("body " + std::to_string(body));
      }
      if (collide(a, bodies.tree(body), *X_AB, scratch, counts)) touching->push_back(body);
    }
  }
  return core::ok_status();
}

}  // namespace prescene::collision
#endif
