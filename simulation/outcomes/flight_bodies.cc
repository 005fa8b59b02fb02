// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <utility>
#include <variant>

#include "prescene/collision/mesh.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/static_shape.h"
#include "prescene/collision/spheres/surface_spheres.h"
#include "prescene/geometry/primitives.h"
#include "prescene/simulation/outcomes/common_flight.h"

namespace prescene::simulation {
namespace {

using geometry::TriangleMesh;

constexpr int kSpheres = 1500;
constexpr double kEdgeFidelity = 0.001;  // m, of things of household size.
constexpr int kSegments = 32;            // of round primitives
// Where the cover is measured, and what it may lack between these places: m, of things of household size.
constexpr int kSurfacePoints = 3000;
constexpr double kBetweenPoints = 3e-4;

/// The closed surfaces that stand for a shape in its body's frame; none of a sheet.
core::Result<std::vector<TriangleMesh>> solids_of(const belief::CollisionShape& shape, ShapeStore& shapes) {
  std::vector<TriangleMesh> solids;
  if (const auto* primitive = std::get_if<belief::PrimitiveShape>(&shape)) {
    solids.push_back(geometry::transformed(geometry::make_mesh(primitive->primitive, kSegments), primitive->X_OS));
    return solids;
  }
  const auto& mesh = std::get<belief::MeshShape>(shape);
  if (mesh.use == belief::MeshUse::kSurface) return solids;
  if (mesh.use == belief::MeshUse::kSpheres) {
    solids.push_back(geometry::transformed(*mesh.mesh, mesh.X_OS));
    return solids;
  }
  PRESCENE_TRY(const auto parts, shapes.convex_parts(mesh.mesh, mesh.use, {}));
  for (const ConvexPolytope& part : *parts) {
    PRESCENE_TRY(const TriangleMesh hull, geometry::convex_hull(part.vertices));
    solids.push_back(geometry::transformed(hull, mesh.X_OS));
  }
  return solids;
}

/// The largest spheres that touch a surface from inside, grown by `margin` so that together they cover it.
core::Result<std::shared_ptr<const collision::SphereTree>> covering(const TriangleMesh& solid, ShapeStore& shapes,
                                                                    double length_scale, double* margin) {
  PRESCENE_TRY(const auto touching, shapes.surface_spheres(std::make_shared<const TriangleMesh>(solid),
                                                           {kSpheres, kEdgeFidelity * length_scale}));
  std::vector<collision::PackedSphere> spheres;
  std::vector<collision::SurfaceAnchor> anchors;
  for (const collision::SurfacePatch& patch : touching->patches) {
    spheres.push_back({patch.centre, patch.radius});
    anchors.push_back({patch.point, patch.normal});
  }
  for (const geometry::SurfacePoint& on : geometry::sample_surface(solid, kSurfacePoints, 1)) {
    double uncovered = std::numeric_limits<double>::infinity();
    for (const collision::PackedSphere& sphere : spheres)
      uncovered =
          std::min(uncovered, (sphere.centre.cast<double>() - on.position).norm() - static_cast<double>(sphere.radius));
    *margin = std::max(*margin, uncovered + kBetweenPoints * length_scale);
  }
  for (collision::PackedSphere& sphere : spheres) sphere.radius += static_cast<float>(*margin);
  core::ThreadPool alone(1);
  PRESCENE_TRY(const auto packing,
               collision::SpherePacking::make(std::move(spheres), std::move(anchors), "of a flight"));
  return collision::SphereTree::make(packing, {}, alone);
}

core::Status add_ball(FlightBodies::Object& object) {
  geometry::Box box;
  for (const auto& part : object.parts)
    for (const collision::PackedSphere& sphere : part->packing().spheres()) {
      const Vector3d centre = sphere.centre.cast<double>(),
                     reach = Vector3d::Constant(static_cast<double>(sphere.radius));
      box.extend(centre - reach);
      box.extend(centre + reach);
    }
  object.middle = box.center();
  double radius = 0.0;
  for (const auto& part : object.parts)
    for (const collision::PackedSphere& sphere : part->packing().spheres())
      radius =
          std::max(radius, (sphere.centre.cast<double>() - object.middle).norm() + static_cast<double>(sphere.radius));
  core::ThreadPool alone(1);
  PRESCENE_TRY(const auto packing,
               collision::SpherePacking::make(
                   std::vector<collision::PackedSphere>{{Eigen::Vector3f::Zero(), static_cast<float>(1.0001 * radius)}},
                   {{Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitZ()}}, "of a flight"));
  PRESCENE_TRY(object.ball, collision::SphereTree::make(packing, {}, alone));
  return core::ok_status();
}

core::Result<std::vector<FlightBodies::Placed>> placed_shapes(const std::vector<belief::CollisionShape>& collision,
                                                              ShapeStore& shapes) {
  std::vector<FlightBodies::Placed> placed;
  core::ThreadPool alone(1);
  const auto add_surface = [&](const TriangleMesh& triangles, collision::SurfaceSide side) -> core::Status {
    PRESCENE_TRY(auto mesh, collision::Mesh::make(triangles, "of a flight"));
    PRESCENE_TRY(auto surface, collision::TriangleSurface::make(std::move(mesh), side, alone));
    placed.push_back({std::make_shared<const collision::TriangleSurface>(std::move(surface)), geometry::Pose{}});
    return core::ok_status();
  };
  for (const belief::CollisionShape& shape : collision) {
    if (const auto* primitive = std::get_if<belief::PrimitiveShape>(&shape)) {
      PRESCENE_TRY(auto made, collision::PrimitiveShape::make(primitive->primitive));
      placed.push_back({std::make_shared<const collision::PrimitiveShape>(std::move(made)), primitive->X_OS});
      continue;
    }
    const auto& mesh = std::get<belief::MeshShape>(shape);
    if (mesh.use == belief::MeshUse::kSurface) {
      PRESCENE_RETURN_IF_ERROR(
          add_surface(geometry::transformed(*mesh.mesh, mesh.X_OS), collision::SurfaceSide::kBoth));
      continue;
    }
    PRESCENE_TRY(const auto solids, solids_of(shape, shapes));
    for (const TriangleMesh& solid : solids)
      PRESCENE_RETURN_IF_ERROR(add_surface(solid, collision::SurfaceSide::kSolid));
  }
  return placed;
}

}  // namespace

core::Result<FlightBodies> FlightBodies::make(const belief::Scene& scene, ShapeStore& shapes, double length_scale) {
  FlightBodies bodies;
  for (const belief::SceneObject& object : scene.objects) {
    Object& made = bodies.objects_.emplace_back();
    for (const belief::CollisionShape& shape : scene.model_of(object).collision) {
      auto solids = solids_of(shape, shapes);
      if (!solids) return solids.status().at(object.name);
      for (const TriangleMesh& solid : *solids) {
        auto tree = covering(solid, shapes, length_scale, &made.margin);
        if (!tree) return tree.status().at(object.name);
        made.parts.push_back(*std::move(tree));
      }
    }
    PRESCENE_RETURN_IF_ERROR(add_ball(made).at(object.name));
  }
  for (const belief::Support& support : scene.supports) {
    auto placed = placed_shapes(support.collision, shapes);
    if (!placed) return placed.status().at(support.name);
    bodies.supports_.push_back(*std::move(placed));
  }
  for (const belief::KinematicBody& body : scene.robot) {
    auto placed = placed_shapes(body.collision, shapes);
    if (!placed) return placed.status().at(body.name);
    bodies.robot_.push_back(*std::move(placed));
  }
  return bodies;
}

}  // namespace prescene::simulation
