// SPDX-License-Identifier: Apache-2.0
// One body against many others: which of them it touches.
//
//   BodySet shelf;
//   PRESCENE_TRY(const std::uint32_t cup, shelf.add(cup_tree, X_WC));    // and so on
//   std::vector<std::uint32_t> touching;                                 // kept, so that nothing is allocated
//   PRESCENE_RETURN_IF_ERROR(collide_many(hand_tree, X_WH, shelf, &touching, scratch));
//
// Boxes about the bodies along the axes of the world, sixteen at a time, leave few for `collide`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision {

/// A box about a body wherever single precision may put it, along the axes of the world.
struct WorldBox {
  std::array<float, 3> low;  ///< m.
  std::array<float, 3> high;
};

/// Bodies in the world. Trees are shared: many bodies may have the same.
class BodySet {
 public:
  /// Returns the body's index: 0, 1, 2 ... Fails with kInvalidInput as to_transform does.
  core::Result<std::uint32_t> add(std::shared_ptr<const TriangleTree> tree, const geometry::Pose& X_WB);
  /// Puts a body (index checked) elsewhere. Fails as `add` does; then it stays.
  core::Status move(std::uint32_t body, const geometry::Pose& X_WB);

  std::uint32_t size() const { return static_cast<std::uint32_t>(bodies_.size()); }
  const TriangleTree& tree(std::uint32_t body) const { return *bodies_[body].tree; }
  const geometry::Pose& pose(std::uint32_t body) const { return bodies_[body].X_WB; }

  /// Sixteen boxes side by side. Those beyond the last body are empty.
  struct alignas(64) Boxes {
    std::array<std::array<float, 16>, 3> low;
    std::array<std::array<float, 16>, 3> high;
  };
  const std::vector<Boxes>& boxes() const { return boxes_; }

 private:
  struct Body {
    std::shared_ptr<const TriangleTree> tree;
    geometry::Pose X_WB;
  };
  void set_box(std::uint32_t body);

  std::vector<Body> bodies_;
  std::vector<Boxes> boxes_;
};

/// Sets `touching` to the bodies, in ascending order, for which `collide` says so with relative_transform(X_WA, X_WB).
/// Fails with kInvalidInput as that does; `touching` is then empty.
core::Status collide_many(const TriangleTree& a, const geometry::Pose& X_WA, const BodySet& bodies,
                          std::vector<std::uint32_t>* touching, QueryScratch& scratch, QueryCounts* counts = nullptr);

}  // namespace prescene::collision
