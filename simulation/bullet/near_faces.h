// SPDX-License-Identifier: Apache-2.0
// Faces of a convex core by nodes of a tree of spheres.
#pragma once

#include <algorithm>
#include <memory>
#include <numeric>
#include <vector>

#include "convex_core.h"
#include "prescene/collision/spheres/surface_spheres.h"

namespace prescene::simulation {

/// Which faces of a polytope decide where it is nearest to the spheres of a node: fewer and fewer from the root of the
/// tree down, so that a scanned hull's thousands of faces are looked at once for all spheres.
class NearFaces {
 public:
  void begin(const collision::SurfaceSpheres& spheres, const ConvexCore& core, const Frame& X_BA) {
    core_ = core.face_count() > 0 ? &core : nullptr;
    X_BA_ = &X_BA;
    if (!core_) return;
    balls_ = &balls_of(spheres);
    if (lists_.empty()) lists_.emplace_back();
    lists_[0].resize(core.face_count());
    std::iota(lists_[0].begin(), lists_[0].end(), 0U);
  }
  /// A node of a level, 1 for the root; the one above it was looked at before.
  void look_at(std::uint32_t node, std::size_t level) {
    if (!core_) return;
    if (lists_.size() <= level) lists_.resize(level + 1);
    const Ball& ball = (*balls_)[node];
    core_->faces_about(*X_BA_ * ball.center, ball.radius, lists_[level - 1], lists_[level]);
    now_ = &lists_[level];
  }
  /// Of a centre below the node that was looked at last; beyond `limit` (m) the distance need not be right.
  ConvexCore::Nearest nearest(const ConvexCore& core, const Vector3d& p_B, double limit) const {
    return core_ ? core.nearest(p_B, *now_, limit) : core.nearest(p_B);
  }

 private:
  /// Holds the centres of all patches below a node.
  struct Ball {
    Vector3d center = Vector3d::Zero();
    double radius = 0.0;
  };
  struct OfTree {
    std::shared_ptr<const collision::SphereTree> tree;  // kept, so that no other one takes its address
    std::vector<Ball> balls;                            // by node
  };

  const std::vector<Ball>& balls_of(const collision::SurfaceSpheres& spheres) {
    for (const OfTree& known : known_)
      if (known.tree == spheres.tree) return known.balls;
    constexpr std::size_t kMostKnown = 64;
    if (known_.size() == kMostKnown) known_.clear();
    known_.push_back({spheres.tree, {}});
    const collision::SphereTree& tree = *spheres.tree;
    const auto centre = [&](std::size_t place) {
      return Vector3d(spheres.patches[tree.order()[place]].centre.cast<double>());
    };
    std::vector<Eigen::AlignedBox3d> boxes(tree.nodes().size());
    std::vector<Ball>& balls = known_.back().balls;
    balls.resize(tree.nodes().size());
    // Children come after their nodes.
    for (std::size_t index = tree.nodes().size(); index-- > 0;) {
      const collision::SphereTree::Node& node = tree.nodes()[index];
      for (std::size_t k = node.first; k < node.first + node.count; ++k) {
        if (node.is_bottom()) {
          boxes[index].extend(centre(k));
        } else {
          boxes[index].extend(boxes[k]);
        }
      }
      balls[index] = {boxes[index].center(), 0.5 * boxes[index].sizes().norm()};
    }
    return balls;
  }

  const ConvexCore* core_ = nullptr;
  const Frame* X_BA_ = nullptr;
  const std::vector<Ball>* balls_ = nullptr;
  std::vector<OfTree> known_;
  std::vector<std::vector<std::uint32_t>> lists_;  // by level
  const std::vector<std::uint32_t>* now_ = nullptr;
};

}  // namespace prescene::simulation
