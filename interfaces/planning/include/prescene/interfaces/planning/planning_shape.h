// SPDX-License-Identifier: Apache-2.0
// The shape of something that a planner moves, or must not meet: triangles, or a tree of spheres.
//
//   core::ThreadPool pool;
//   PRESCENE_TRY(const PlanningShape cup, PlanningShape::of_mesh(mesh, "cup", pool));
//   PRESCENE_TRY(const PlanningShape rod, PlanningShape::of_primitive(geometry::Cylinder{0.01, 0.5}, "rod", pool));
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "prescene/belief/object_model.h"
#include "prescene/collision/query_scratch.h"
#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/static_shape.h"
#include "prescene/collision/triangle_tree.h"
#include "prescene/core/parallel.h"
#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/primitives.h"

namespace prescene::interfaces {

/// Memory of queries on shapes. One a thread; after the first queries nothing is allocated any more.
struct ShapeScratch {
  collision::QueryScratch triangles;
  collision::SphereScratch spheres;
};

/// Immutable; copies share what is expensive. A closed mesh is a solid: what is wholly inside of it collides. An open
/// one is a sheet.
class PlanningShape {
 public:
  /// Fails with kInvalidInput as collision::Mesh::make does.
  static core::Result<PlanningShape> of_mesh(const geometry::TriangleMesh& mesh, std::string_view name,
                                             core::ThreadPool& pool);
  /// Curved primitives become polyhedra of 64 sides that contain them, at most 0.25 % of the radius larger.
  static core::Result<PlanningShape> of_primitive(const geometry::Primitive& primitive, std::string_view name,
                                                  core::ThreadPool& pool);
  /// All shapes of a body as one. Meshes count as their triangles, whatever their MeshUse says.
  static core::Result<PlanningShape> of_shapes(const std::vector<belief::CollisionShape>& shapes, std::string_view name,
                                               core::ThreadPool& pool);
  /// The spheres of a packing. They lie inside the body that was packed, which may touch where they do not. The tree is
  /// there (checked).
  static PlanningShape of_spheres(std::shared_ptr<const collision::SphereTree> tree);

  /// Null for spheres.
  const std::shared_ptr<const collision::TriangleTree>& triangles() const { return triangles_; }
  /// Null for triangles.
  const std::shared_ptr<const collision::SphereTree>& spheres() const { return spheres_; }
  bool is_solid() const { return is_solid_; }
  /// About all of the shape, in its frame, m.
  const geometry::Box& box() const { return box_; }
  /// Of a ball about the middle of the box, m.
  double ball_radius() const { return ball_radius_; }
  /// Of a ball about the origin of the shape's frame, m.
  double reach() const { return reach_; }

  friend bool shapes_meet(const PlanningShape& a, const PlanningShape& b, const geometry::Pose& X_AB, double margin,
                          ShapeScratch& scratch);
  friend double shape_gap(const PlanningShape& a, const PlanningShape& b, const geometry::Pose& X_AB, double below,
                          ShapeScratch& scratch);

 private:
  PlanningShape() = default;

  std::shared_ptr<const collision::TriangleTree> triangles_;
  std::shared_ptr<const collision::TriangleSurface> surface_;  // The same triangles, as spheres meet them.
  std::shared_ptr<const collision::SphereTree> spheres_;
  bool is_solid_ = false;
  geometry::Box box_;
  double ball_radius_ = 0.0;
  double reach_ = 0.0;
};

/// Whether the shapes are within `margin` (m, not negative) of each other, or one is inside the other; touching counts.
/// True for poses that are not finite.
bool shapes_meet(const PlanningShape& a, const PlanningShape& b, const geometry::Pose& X_AB, double margin,
                 ShapeScratch& scratch);

/// A lower bound of the distance of the surfaces, m; infinity where it is `below` or more. It is 0 where triangles
/// intersect, negative where spheres are inside of something, and falls short of the distance only by what single
/// precision does to coordinates: 4e-6 of the sizes and the distance of the frames, all added up. 0 for poses that are
/// not finite.
double shape_gap(const PlanningShape& a, const PlanningShape& b, const geometry::Pose& X_AB, double below,
                 ShapeScratch& scratch);

}  // namespace prescene::interfaces
