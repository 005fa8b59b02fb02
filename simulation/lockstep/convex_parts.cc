// SPDX-License-Identifier: Apache-2.0
#include "convex_parts.h"

#include <algorithm>
#include <cmath>

#include "lane_spheres.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {
namespace {

using geometry::Matrix3d;
using geometry::Pose;

constexpr PolytopeLimits kLimits{};
static_assert(kLimits.corners == std::size_t{kMaxLoop});

/// Where a body's parts go: from the frame that shapes are given in to that of the lanes.
struct Placement {
  Matrix3d R;
  Vector3d p;
};

ConvexPart primitive_part(const geometry::Primitive& primitive, const Placement& X, double rounding) {
  ConvexPart part;
  Vector3d half;
  if (const auto* sphere = std::get_if<geometry::Sphere>(&primitive)) {
    part.kind = CoreKind::kPoint;
    part.radius = part.ball = sphere->radius;
    part.box_half = plain(Vector3d(Vector3d::Constant(sphere->radius)));
    part.R_PS = plain(X.R);
    part.center = plain(X.p);
    return part;
  }
  if (const auto* box = std::get_if<geometry::BoxShape>(&primitive)) {
    part.kind = CoreKind::kBox;
    half = 0.5 * box->size;
    part.radius = rounded_edge(rounding, half.minCoeff());
    part.half = plain(Vector3d(half - Vector3d::Constant(part.radius)));
    part.ball = half.norm();
  } else if (const auto* cylinder = std::get_if<geometry::Cylinder>(&primitive)) {
    part.kind = CoreKind::kCylinder;
    half = {cylinder->radius, cylinder->radius, 0.5 * cylinder->length};
    part.radius = rounded_edge(rounding, std::min(half.x(), half.z()));
    part.half = {half.x() - part.radius, half.x() - part.radius, half.z() - part.radius};
    part.ball = std::sqrt(half.x() * half.x() + half.z() * half.z());
  } else if (const auto* capsule = std::get_if<geometry::Capsule>(&primitive)) {
    part.kind = CoreKind::kSegment;
    part.radius = capsule->radius;
    part.half = {0.0, 0.0, 0.5 * capsule->length};
    half = {capsule->radius, capsule->radius, 0.5 * capsule->length + capsule->radius};
    part.ball = half.z();
  } else {
    const auto& cone = std::get<geometry::Cone>(primitive);
    part.kind = CoreKind::kCone;
    // A ball inside of it bounds the rounding; base and side moved inwards by the same length leave a similar cone.
    const double slant = std::hypot(cone.radius, cone.length);
    part.radius = rounded_edge(rounding, cone.radius * cone.length / (slant + cone.radius));
    const double base = -0.5 * cone.length + part.radius;
    const double tip = 0.5 * cone.length - part.radius * slant / cone.radius;
    part.half = {(tip - base) * cone.radius / cone.length, tip, base};
    half = {cone.radius, cone.radius, 0.5 * cone.length};
    part.ball = std::hypot(cone.radius, 0.5 * cone.length);
  }
  part.R_PS = plain(X.R);
  part.center = plain(X.p);
  part.box_half = plain(Vector3d(X.R.cwiseAbs() * half));
  return part;
}

ConvexPart hull_part(const ConvexPolytope& hull, const RoundedPolytope& rounded, const Placement& X) {
  ConvexPart part;
  part.kind = CoreKind::kHull;
  part.radius = rounded.radius;
  part.hull_error = rounded.error;
  const ConvexPolytope& core = rounded.core;
  Eigen::AlignedBox3d box;
  for (const Vector3d& v : hull.vertices) box.extend(X.R * v + X.p);
  const Vector3d center = box.center();
  part.center = plain(center);
  part.box_half = plain(Vector3d(0.5 * box.sizes()));
  for (const Vector3d& v : hull.vertices) part.ball = std::max(part.ball, (X.R * v + X.p - center).norm());
  for (const Vector3d& v : core.vertices) part.vertices.push_back(plain(Vector3d(X.R * v + X.p - center)));
  for (const ConvexPolytope::Face& face : core.faces) {
    const std::size_t corners = face.loop.size();
    const std::array<double, 3> normal = plain(Vector3d(X.R * face.normal));
    const std::array<double, 3>& corner = part.vertices[face.loop[0]];
    const double offset = normal[0] * corner[0] + normal[1] * corner[1] + normal[2] * corner[2];
    part.normals.push_back(normal);
    part.planes.push_back({static_cast<Real>(normal[0]), static_cast<Real>(normal[1]), static_cast<Real>(normal[2]),
                           static_cast<Real>(offset)});
    part.corner_counts.push_back(static_cast<int>(corners));
    part.longest_loop = std::max(part.longest_loop, static_cast<int>(corners));
    for (std::size_t k = 0; k < static_cast<std::size_t>(kMaxLoop); ++k) {
      part.face_corners.push_back(part.vertices[face.loop[std::min(k, corners - 1)]]);
    }
  }
  constexpr std::size_t kWidth = kLaneMultiple;
  const std::size_t rows = (part.planes.size() + kWidth - 1) / kWidth * kWidth;
  for (std::size_t k = 0; k < 4; ++k) {
    part.plane_rows[k].assign(rows, k < 3 ? Real(0) : Real(1e30));  // those beyond the last are below everything
    for (std::size_t f = 0; f < part.planes.size(); ++f) part.plane_rows[k][f] = part.planes[f][k];
  }
  return part;
}

ConvexPart spheres_part(const belief::MeshPtr& mesh, const collision::SurfaceSpheres& spheres, const Placement& X) {
  ConvexPart part;
  part.kind = CoreKind::kSpheres;
  const geometry::MeshFacts facts = geometry::facts_of(mesh);
  const geometry::Box& box = facts.box;
  const Vector3d middle = box.center();
  const double rise = spheres.rise;
  part.spheres = lanes_of(spheres, plain(middle));
  part.R_PS = plain(X.R);
  part.center = plain(Vector3d(X.R * middle + X.p));
  part.box_half = plain(Vector3d(X.R.cwiseAbs() * (0.5 * box.sizes() + Vector3d::Constant(rise))));
  part.ball = facts.radius + rise;
  return part;
}

/// Appends the parts of a shape.
core::Status add_shape(const belief::CollisionShape& shape, const Pose& X_LB, double rounding, ShapeStore& shapes,
                       const DecompositionSettings& decomposition, std::vector<ConvexPart>& parts) {
  const Matrix3d R = X_LB.rotation.toRotationMatrix();
  const auto placed = [&](const Pose& X_BS) {
    return Placement{R * X_BS.rotation.toRotationMatrix(), R * X_BS.translation + X_LB.translation};
  };
  if (const auto* primitive = std::get_if<belief::PrimitiveShape>(&shape)) {
    parts.push_back(primitive_part(primitive->primitive, placed(primitive->X_OS), rounding));
    return core::ok_status();
  }
  const auto& mesh = std::get<belief::MeshShape>(shape);
  if (!mesh.mesh) return core::invalid_input("a collision mesh is missing");
  if (mesh.use == belief::MeshUse::kSurface) {
    return core::unsupported("triangle surfaces are not simulated in lockstep");
  }
  if (mesh.use == belief::MeshUse::kSpheres) {
    PRESCENE_TRY(const auto spheres, shapes.surface_spheres(mesh.mesh, mesh.spheres));
    parts.push_back(spheres_part(mesh.mesh, *spheres, placed(mesh.X_OS)));
    return core::ok_status();
  }
  PRESCENE_TRY(const auto hulls, shapes.convex_parts(mesh.mesh, mesh.use, decomposition));
  std::vector<double> radii;
  for (const ConvexPolytope& hull : *hulls) radii.push_back(rounded_edge(rounding, hull.inner_radius()));
  PRESCENE_TRY(const auto rounded, shapes.rounded_parts(mesh.mesh, mesh.use, decomposition, radii, kLimits));
  for (std::size_t i = 0; i < hulls->size(); ++i)
    parts.push_back(hull_part((*hulls)[i], (*rounded)[i], placed(mesh.X_OS)));
  return core::ok_status();
}

}  // namespace

ConvexPart convex_part(const geometry::Primitive& primitive, double rounding) {
  return primitive_part(primitive, {Matrix3d::Identity(), Vector3d::Zero()}, rounding);
}

core::Status add_shapes(const std::string& name, const std::vector<belief::CollisionShape>& collision,
                        const geometry::Pose& X_LB, double rounding, ShapeStore& shapes,
                        const DecompositionSettings& decomposition, std::vector<ConvexPart>& parts) {
  for (std::size_t i = 0; i < collision.size(); ++i) {
    const core::Status status = add_shape(collision[i], X_LB, rounding, shapes, decomposition, parts);
    if (!status.ok()) return status.at(name + ", shape " + std::to_string(i + 1));
  }
  return core::ok_status();
}

}  // namespace prescene::simulation
