// SPDX-License-Identifier: Apache-2.0
// Whether bodies that move along a straight line without turning hit what stands there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prescene/collision/query_scratch.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/parallel.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::queries {

class SweptBodies {
 public:
  explicit SweptBodies(core::ThreadPool& pool) : pool_(pool) {}

  /// Fails as collision::Mesh::make does.
  core::Status add_obstacle(const std::string& name, const geometry::TriangleMesh& mesh, const geometry::Pose& X_WB);
  core::Status add_mover(const std::string& name, const geometry::TriangleMesh& mesh);
  std::size_t movers() const { return movers_.size(); }

  /// A mover comes along `way` (m, W) to X_WM. What it meets before the last `slack` metres, as "MOVER hits OBSTACLE";
  /// nothing if it meets nothing.
  std::optional<std::string> first_hit(std::size_t mover, const geometry::Pose& X_WM, const geometry::Vector3d& way,
                                       double slack);

 private:
  struct Body {
    std::string name;
    collision::TriangleTree tree;
    geometry::Pose X_WB;
  };
  core::ThreadPool& pool_;
  std::vector<Body> obstacles_, movers_;
  collision::QueryScratch scratch_;
};

}  // namespace prescene::queries
