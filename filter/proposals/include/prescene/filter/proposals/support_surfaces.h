// SPDX-License-Identifier: Apache-2.0
// Where an object cannot be, seen or not: inside a support or a body of the robot, or half on its other side. Depth
// says nothing about a hidden object, so without this its particles would sink into the floor and the walls that hide
// it.
//
//   SupportSurfaces surfaces(*scene, meshes);
//   surfaces.overlap(*target.mesh, X_WO, 0.015);   // 0: free, 1: inside a support
//   surfaces.place(gripper, X_WG);                 // surfaces of a body that moves, known in its own frame
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::filter {

/// The triangles of a scene's supports, in W, and of what else is put there. Copies share them. Safe to read from
/// several threads.
class SupportSurfaces {
 public:
  SupportSurfaces() = default;
  SupportSurfaces(const belief::Scene& scene, MeshCache& meshes);

  /// Adds a flat region that is known in C, and a thing.
  void add(const rendering::SupportRegion& region, const geometry::Pose& X_WC);
  void add(const rendering::RenderMesh& mesh, const geometry::Pose& X_WM);
  /// Adds surfaces that are known in the frame B of a body, where the body is now.
  void place(const SupportSurfaces& body, const geometry::Pose& X_WB);

  bool empty() const { return parts_.empty(); }

  /// A surface that a ray meets.
  struct Hit {
    double distance = 0.0;        ///< m, from where the ray begins.
    geometry::Vector3d normal_W;  ///< Unit, towards where it begins.
  };
  /// The first surface within `reach` (m) from p_W along a unit direction; of closed supports, those that are entered.
  std::optional<Hit> first_along(const geometry::Vector3d& p_W, const geometry::Vector3d& direction_W,
                                 double reach) const;
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
  /// A part and where it is; in W itself without a pose.
  struct Placed {
    std::shared_ptr<const Part> part;
    std::optional<geometry::Pose> X_PW;
    geometry::Vector3d in_part(const geometry::Vector3d& p_W) const { return X_PW ? *X_PW * p_W : p_W; }
  };
  static int crossings(const Part& part, const geometry::Vector3d& p, const geometry::Vector3d& q);

  std::vector<Placed> parts_;  // one a support or body
};

}  // namespace prescene::filter
