// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/planning/planning_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include "prescene/collision/distance_queries.h"
#include "prescene/collision/point_queries.h"
#include "prescene/collision/spheres/static_shape_queries.h"
#include "prescene/collision/triangle_queries.h"
#include "prescene/core/check.h"

namespace prescene::interfaces {
namespace {

using collision::Transform;
using collision::TriangleTree;
using geometry::Pose;
using geometry::Vector3d;

constexpr double kFar = std::numeric_limits<double>::infinity();
constexpr int kSides = 64;
// What single precision does to coordinates and distances, as a share of the sizes (distance_queries.h); less would let
// a gap be reported that is larger than that of the bodies.
constexpr double kRounding = 4e-6;

/// The polyhedron's faces are as far from the axis, or the middle, as the primitive's surface: they are nearer than its
/// corners by the cosine of half an angle between corners, around and along.
geometry::TriangleMesh mesh_about(geometry::Primitive primitive) {
  const double cosine = std::cos(std::numbers::pi / kSides);
  std::visit(
      [&](auto& shape) {
        if constexpr (!std::is_same_v<std::decay_t<decltype(shape)>, geometry::BoxShape>)
          shape.radius /= cosine * cosine;
      },
      primitive);
  return geometry::make_mesh(primitive, kSides);
}

/// Lower bound of the distance: of a ball about one from the box of the other, both ways.
double box_gap(const PlanningShape& a, const PlanningShape& b, const Pose& X_AB) {
  const Vector3d p_AB = X_AB * Vector3d(b.box().center());
  const Vector3d p_BA = X_AB.inverse() * Vector3d(a.box().center());
  return std::max(a.box().exteriorDistance(p_AB) - b.ball_radius(), b.box().exteriorDistance(p_BA) - a.ball_radius());
}

/// Of surfaces that do not intersect: whether a part of `inner` is inside of `outer`.
bool is_inside(const TriangleTree& inner, const PlanningShape& outer, const Pose& X_outer_inner) {
  if (!outer.is_solid()) return false;
  const auto& corners = inner.mesh().corners_of_parts();
  return std::any_of(corners.begin(), corners.end(), [&](const collision::Vector3f& corner) {
    const Vector3d p = X_outer_inner * Vector3d(corner.cast<double>());
    return outer.box().contains(p) && collision::winding_number(*outer.triangles(), p) != 0;
  });
}

}  // namespace

core::Result<PlanningShape> PlanningShape::of_mesh(const geometry::TriangleMesh& mesh, std::string_view name,
                                                   core::ThreadPool& pool) {
  PRESCENE_TRY(auto checked, collision::Mesh::make(mesh, name));
  PlanningShape shape;
  shape.is_solid_ = geometry::mesh_topology(mesh).bounds_volume();
  for (const auto& vertex : checked->vertices()) shape.box_.extend(Vector3d(vertex.cast<double>()));
  const Vector3d middle = shape.box_.center();
  for (const auto& vertex : checked->vertices()) {
    const Vector3d p = vertex.cast<double>();
    shape.ball_radius_ = std::max(shape.ball_radius_, (p - middle).norm());
    shape.reach_ = std::max(shape.reach_, p.norm());
  }
  shape.triangles_ = std::make_shared<const TriangleTree>(TriangleTree::build(std::move(checked), {}, pool));
  using collision::SurfaceSide;
  auto surface =
      collision::TriangleSurface::make(shape.triangles_, shape.is_solid_ ? SurfaceSide::kSolid : SurfaceSide::kBoth);
  // Closed in double precision, open in single: then it is a sheet for spheres.
  if (!surface) surface = collision::TriangleSurface::make(shape.triangles_, SurfaceSide::kBoth);
  if (!surface) return surface.status();
  shape.surface_ = std::make_shared<const collision::TriangleSurface>(*std::move(surface));
  return shape;
}

core::Result<PlanningShape> PlanningShape::of_primitive(const geometry::Primitive& primitive, std::string_view name,
                                                        core::ThreadPool& pool) {
  return of_mesh(mesh_about(primitive), name, pool);
}

core::Result<PlanningShape> PlanningShape::of_shapes(const std::vector<belief::CollisionShape>& shapes,
                                                     std::string_view name, core::ThreadPool& pool) {
  if (shapes.empty()) return core::invalid_input(std::string(name) + ": it has no shape: give a primitive or a mesh");
  geometry::TriangleMesh joined;
  for (const belief::CollisionShape& shape : shapes) {
    if (const auto* primitive = std::get_if<belief::PrimitiveShape>(&shape)) {
      joined = geometry::joined(joined, geometry::transformed(mesh_about(primitive->primitive), primitive->X_OS));
    } else {
      const auto& mesh = std::get<belief::MeshShape>(shape);
      joined = geometry::joined(joined, geometry::transformed(*mesh.mesh, mesh.X_OS));
    }
  }
  return of_mesh(joined, name, pool);
}

PlanningShape PlanningShape::of_spheres(std::shared_ptr<const collision::SphereTree> tree) {
  PRESCENE_CHECK(tree != nullptr);
  PlanningShape shape;
  const auto& ball = tree->root();
  const Vector3d middle = ball.centre.cast<double>();
  const double radius = ball.radius;
  shape.box_ = geometry::Box(middle - Vector3d::Constant(radius), middle + Vector3d::Constant(radius));
  shape.ball_radius_ = radius;
  shape.reach_ = middle.norm() + radius;
  shape.is_solid_ = true;
  shape.spheres_ = std::move(tree);
  return shape;
}

bool shapes_meet(const PlanningShape& a, const PlanningShape& b, const Pose& X_AB, double margin,
                 ShapeScratch& scratch) {
  if (box_gap(a, b, X_AB) > margin) return false;
  if (a.spheres_ || b.spheres_) return shape_gap(a, b, X_AB, std::nextafter(margin, kFar), scratch) <= margin;
  const auto X = collision::to_transform(X_AB);
  if (!X) return true;
  const bool near = margin > 0.0
                        ? collision::within_distance(*a.triangles_, *b.triangles_, *X, margin, scratch.triangles)
                        : collision::collide(*a.triangles_, *b.triangles_, *X, scratch.triangles);
  return near || is_inside(*b.triangles_, a, X_AB) || is_inside(*a.triangles_, b, X_AB.inverse());
}

double shape_gap(const PlanningShape& a, const PlanningShape& b, const Pose& X_AB, double below,
                 ShapeScratch& scratch) {
  const auto X = collision::to_transform(X_AB);
  if (!X) return 0.0;
  if (box_gap(a, b, X_AB) >= below) return kFar;
  const double slack = kRounding * (a.reach_ + b.reach_ + X_AB.translation.norm());
  const double limit = below + slack;
  std::optional<double> gap;
  if (a.triangles_ && b.triangles_) {
    const auto near = collision::distance(*a.triangles_, *b.triangles_, *X, {.limit = limit}, scratch.triangles);
    if (near) gap = near->distance > 0.0 ? std::max(near->distance - slack, 0.0) : 0.0;
  } else if (a.spheres_ && b.spheres_) {
    const auto near = collision::distance(*a.spheres_, *b.spheres_, *X, scratch.spheres, limit);
    if (near) gap = near->distance - slack;
  } else if (a.spheres_) {
    const auto near = collision::distance(*a.spheres_, *b.surface_, *X, scratch.spheres, limit);
    if (near) gap = near->distance - slack;
  } else {
    return shape_gap(b, a, X_AB.inverse(), below, scratch);
  }
  return gap && *gap < below ? *gap : kFar;
}

}  // namespace prescene::interfaces
