// SPDX-License-Identifier: Apache-2.0
// Bodies in a world of Bullet as shipped: its broadphase, collision algorithms, manifolds and solver, in double
// precision.
#pragma once

#include <memory>
#include <vector>

#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::tests {

struct BulletBody {
  /// Convex parts, which become a btCompoundShape of btConvexHullShape, or one mesh of any shape as GImpact. A body
  /// without mass (fixed) is a box of `box` (full edges, m).
  std::vector<geometry::TriangleMesh> parts;
  bool gimpact = false;
  geometry::Vector3d box = geometry::Vector3d::Zero();
  geometry::MassProperties mass;  ///< In the body's frame; mass 0: fixed.
  geometry::Pose start;
};

class BulletWorld {
 public:
  /// Gravity along -z; margins of 0.2 mm; nothing sleeps.
  explicit BulletWorld(const std::vector<BulletBody>& bodies);
  ~BulletWorld();
  BulletWorld(const BulletWorld&) = delete;
  BulletWorld& operator=(const BulletWorld&) = delete;

  void reset();  ///< All bodies at their starts.
  void step(double dt);
  geometry::Pose pose(std::size_t body) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::tests
