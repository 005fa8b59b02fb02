// SPDX-License-Identifier: Apache-2.0
#include "swept_bodies.h"

#include <utility>

#include "prescene/collision/continuous_queries.h"
#include "prescene/collision/point_queries.h"

namespace prescene::queries {
namespace {

core::Result<collision::TriangleTree> tree_of(const geometry::TriangleMesh& mesh, const std::string& name,
                                              core::ThreadPool& pool) {
  PRESCENE_TRY(auto rounded, collision::Mesh::make(mesh, name));
  return collision::TriangleTree::build(std::move(rounded), {}, pool);
}

}  // namespace

core::Status SweptBodies::add_obstacle(const std::string& name, const geometry::TriangleMesh& mesh,
                                       const geometry::Pose& X_WB) {
  PRESCENE_TRY(auto tree, tree_of(mesh, name, pool_));
  obstacles_.push_back({name, std::move(tree), X_WB});
  return core::ok_status();
}

core::Status SweptBodies::add_mover(const std::string& name, const geometry::TriangleMesh& mesh) {
  PRESCENE_TRY(auto tree, tree_of(mesh, name, pool_));
  movers_.push_back({name, std::move(tree), {}});
  return core::ok_status();
}

std::optional<std::string> SweptBodies::first_hit(std::size_t mover, const geometry::Pose& X_WM,
                                                  const geometry::Vector3d& way, double slack) {
  const Body& moves = movers_[mover];
  geometry::Pose X_WM_start = X_WM;
  X_WM_start.translation -= way;
  const double length = way.norm();
  for (const Body& obstacle : obstacles_) {
    const geometry::Pose X_BW = obstacle.X_WB.inverse();
    const auto screw = collision::ScrewMotion::make(X_BW * X_WM_start, X_BW * X_WM);
    if (!screw) return moves.name + " can't be brought there";
    const collision::FirstContact contact = collision::first_contact(obstacle.tree, moves.tree, *screw, {}, scratch_);
    if (contact.outcome == collision::MotionOutcome::kNoContact) {
      // No surfaces meet: it is free of the obstacle, or all in it.
      const Eigen::Vector3d corner = moves.tree.mesh().vertices().front().cast<double>();
      if (collision::winding_number(obstacle.tree, X_BW * (X_WM * corner)) <= 0) continue;
      return moves.name + " is inside " + obstacle.name;
    }
    if ((1.0 - contact.time) * length <= slack) continue;
    return moves.name + " hits " + obstacle.name;
  }
  return std::nullopt;
}

}  // namespace prescene::queries
