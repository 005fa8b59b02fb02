// SPDX-License-Identifier: Apache-2.0
// Rays against triangle meshes by Embree 3, as an independent reference for depth images and ray queries.
#pragma once

#include <memory>
#include <optional>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::tests {

/// Where a ray first meets a mesh.
struct RayHit {
  double t = 0.0;             ///< Along the ray, in lengths of its direction.
  int mesh = 0;               ///< In the order of adding.
  geometry::Vector3d normal;  ///< Of the triangle, unit, its own orientation.
};

class RayCaster {
 public:
  RayCaster();
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// Adds a mesh, single precision inside.
  void add(const geometry::TriangleMesh& mesh);
  /// The first hit with t in [t_near, t_far]; both sides of triangles count.
  std::optional<RayHit> cast(const geometry::Vector3d& origin, const geometry::Vector3d& direction, double t_near,
                             double t_far) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::tests
