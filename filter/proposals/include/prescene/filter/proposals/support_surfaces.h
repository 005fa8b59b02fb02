// SPDX-License-Identifier: Apache-2.0
// Where an object cannot be, seen or not: inside a support, or half on its other side. Depth says nothing about a
// hidden object, so without this its particles would sink into the floor and the walls that hide it.
//
//   SupportSurfaces surfaces(*scene, meshes);
//   surfaces.overlap(*target.mesh, X_WO, 0.015);   // 0: free, 1: inside a support
#pragma once

#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::filter {

/// The triangles of a scene's supports, in W. Safe to read from several threads.
class SupportSurfaces {
 public:
  SupportSurfaces() = default;
  SupportSurfaces(const belief::Scene& scene, MeshCache& meshes);

  /// Adds a flat region that is known in C, and a thing.
  void add(const rendering::SupportRegion& region, const geometry::Pose& X_WC);
  void add(const rendering::RenderMesh& mesh, const geometry::Pose& X_WM);

  bool empty() const { return parts_.empty(); }

  /// Whether the segment from p_W to q_W crosses a surface.
  bool crosses(const geometry::Vector3d& p_W, const geometry::Vector3d& q_W) const;
  /// Whether the point lies inside a closed support (by the parity of the surfaces between it and a point far away).
  bool inside(const geometry::Vector3d& p_W) const;
  /// Share of an object that is cut off from its middle by a support: of the segments from the middle of its bounding
  /// box to its vertices (at most 64 of them), after shrinking the box by `tolerance` (m) on each side, those that
  /// cross a surface; 1 when the middle itself is inside. Exact for boxes; what stands in a cup's hollow counts as in
  /// it.
  double overlap(const rendering::RenderMesh& mesh, const geometry::Pose& X_WO, double tolerance) const;

 private:
  struct Triangle {
    geometry::Vector3d a, ab, ac;
  };
  struct Part {
    std::vector<Triangle> triangles;
    geometry::Box box;
    bool closed = true;
  };
  int crossings(const Part& part, const geometry::Vector3d& p, const geometry::Vector3d& q) const;

  std::vector<Part> parts_;  // one a support
};

}  // namespace prescene::filter
