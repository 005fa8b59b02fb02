// SPDX-License-Identifier: Apache-2.0
#include "compile_scene.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "prescene/belief/validation.h"
#include "prescene/geometry/mass_properties.h"

namespace prescene::simulation {
namespace {

using geometry::Matrix3d;
using geometry::Pose;

constexpr std::size_t kMostVertices = 64;
constexpr std::size_t kMostParts = 16;
constexpr std::size_t kMostFixed = 256;
// As in Bullet's stepper: a core keeps at least half of the shape's thickness.
constexpr double kLargestShare = 0.5;

std::array<double, 3> plain(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }
std::array<double, 9> plain(const Matrix3d& R) {
  std::array<double, 9> rows;
  for (int i = 0; i < 9; ++i) rows[static_cast<std::size_t>(i)] = R(i / 3, i % 3);
  return rows;
}

double core_radius(double rounding, double thinnest) { return std::min(rounding, kLargestShare * thinnest); }

/// Where a body's parts go: from the frame that shapes are given in to that of the lanes.
struct Placement {
  Matrix3d R;
  Vector3d p;
};

core::Result<ConvexPart> primitive_part(const geometry::Primitive& primitive, const Placement& X, double rounding) {
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
    part.radius = core_radius(rounding, half.minCoeff());
    part.half = plain(Vector3d(half - Vector3d::Constant(part.radius)));
    part.ball = half.norm();
  } else if (const auto* cylinder = std::get_if<geometry::Cylinder>(&primitive)) {
    part.kind = CoreKind::kCylinder;
    half = {cylinder->radius, cylinder->radius, 0.5 * cylinder->length};
    part.radius = core_radius(rounding, std::min(half.x(), half.z()));
    part.half = {half.x() - part.radius, half.x() - part.radius, half.z() - part.radius};
    part.ball = std::sqrt(half.x() * half.x() + half.z() * half.z());
  } else if (const auto* capsule = std::get_if<geometry::Capsule>(&primitive)) {
    part.kind = CoreKind::kSegment;
    part.radius = capsule->radius;
    part.half = {0.0, 0.0, 0.5 * capsule->length};
    half = {capsule->radius, capsule->radius, 0.5 * capsule->length + capsule->radius};
    part.ball = half.z();
  } else {
    return core::unsupported("cones are not simulated in lockstep");
  }
  part.R_PS = plain(X.R);
  part.center = plain(X.p);
  part.box_half = plain(Vector3d(X.R.cwiseAbs() * half));
  return part;
}

core::Result<ConvexPart> hull_part(const ConvexPolytope& hull, const Placement& X, double rounding) {
  ConvexPart part;
  part.kind = CoreKind::kHull;
  part.radius = core_radius(rounding, hull.inner_radius());
  ConvexPolytope core = hull;
  if (std::optional<ConvexPolytope> smaller = inset(hull, part.radius)) {
    core = std::move(*smaller);
  } else {
    part.radius = 0.0;
  }
  if (core.vertices.size() > kMostVertices) {
    return core::unsupported("a hull has " + std::to_string(core.vertices.size()) + " vertices, more than " +
                             std::to_string(kMostVertices) + ", which are not simulated in lockstep");
  }
  Eigen::AlignedBox3d box;
  for (const Vector3d& v : hull.vertices) box.extend(X.R * v + X.p);
  const Vector3d center = box.center();
  part.center = plain(center);
  part.box_half = plain(Vector3d(0.5 * box.sizes()));
  for (const Vector3d& v : hull.vertices) part.ball = std::max(part.ball, (X.R * v + X.p - center).norm());
  for (const Vector3d& v : core.vertices) part.vertices.push_back(plain(Vector3d(X.R * v + X.p - center)));
  for (const ConvexPolytope::Face& face : core.faces) {
    const std::size_t corners = face.loop.size();
    if (corners > static_cast<std::size_t>(kMaxLoop)) {
      return core::unsupported("a side of a hull has " + std::to_string(corners) + " corners, more than " +
                               std::to_string(kMaxLoop) + ", which are not simulated in lockstep");
    }
    part.normals.push_back(plain(Vector3d(X.R * face.normal)));
    part.corner_counts.push_back(static_cast<int>(corners));
    part.longest_loop = std::max(part.longest_loop, static_cast<int>(corners));
    for (std::size_t k = 0; k < static_cast<std::size_t>(kMaxLoop); ++k) {
      part.face_corners.push_back(part.vertices[face.loop[std::min(k, corners - 1)]]);
    }
  }
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
    PRESCENE_TRY(ConvexPart part, primitive_part(primitive->primitive, placed(primitive->X_OS), rounding));
    parts.push_back(std::move(part));
    return core::ok_status();
  }
  const auto& mesh = std::get<belief::MeshShape>(shape);
  if (!mesh.mesh) return core::invalid_input("a collision mesh is missing");
  if (mesh.use == belief::MeshUse::kSurface) {
    return core::unsupported("triangle surfaces are not simulated in lockstep");
  }
  PRESCENE_TRY(const auto hulls, shapes.convex_parts(*mesh.mesh, mesh.use, decomposition));
  for (const ConvexPolytope& hull : *hulls) {
    PRESCENE_TRY(ConvexPart part, hull_part(hull, placed(mesh.X_OS), rounding));
    parts.push_back(std::move(part));
  }
  return core::ok_status();
}

core::Status add_shapes(const std::string& name, const std::vector<belief::CollisionShape>& collision, const Pose& X_LB,
                        double rounding, ShapeStore& shapes, const DecompositionSettings& decomposition,
                        std::vector<ConvexPart>& parts) {
  for (std::size_t i = 0; i < collision.size(); ++i) {
    const core::Status status = add_shape(collision[i], X_LB, rounding, shapes, decomposition, parts);
    if (!status.ok()) return status.at(name + ", shape " + std::to_string(i + 1));
  }
  return core::ok_status();
}

/// What of a scene is beyond lockstep, before shapes are looked at.
core::Status check_bodies(const belief::Scene& scene) {
  if (scene.objects.size() != 1) {
    return core::unsupported("lockstep simulates one object, and the scene has " +
                             std::to_string(scene.objects.size()));
  }
  const belief::SceneObject& object = scene.objects.front();
  if (object.held_by) {
    return core::unsupported(object.name + " is held at the start, which is not simulated in lockstep");
  }
  for (const belief::KinematicBody& robot : scene.robot) {
    if (!robot.collision.empty()) {
      return core::unsupported(robot.name + " is a robot body with a shape, which is not simulated in lockstep");
    }
  }
  RunRequest request;
  request.actions = scene.actions;
  return lockstep_supports(request);
}

void add_fixed(const belief::Support& support, int body, std::vector<ConvexPart> parts, LockstepScene& lanes) {
  for (ConvexPart& part : parts) {
    FixedPart fixed;
    fixed.body = body;
    fixed.friction = static_cast<Real>(belief::mean(support.contact.friction));
    fixed.impact_friction = support.contact.impact_friction
                                ? static_cast<Real>(belief::mean(*support.contact.impact_friction))
                                : fixed.friction;
    fixed.restitution = static_cast<Real>(belief::mean(support.contact.restitution));
    fixed.rolling_arm = static_cast<Real>(std::max(support.contact.rolling_friction, lanes.rolling_arm));
    lanes.rolls = lanes.rolls || fixed.rolling_arm > 0;
    const bool box = part.kind == CoreKind::kBox;
    fixed.R_WB = box ? part.R_PS : plain(Matrix3d(Matrix3d::Identity()));
    const int index = static_cast<int>(lanes.fixed.size());
    for (int face = 0; face < 6; ++face) {
      // Kept for hulls, too, so that planes are found by the part's index.
      const auto axis = static_cast<std::size_t>(face / 2);
      const double sign = face % 2 == 0 ? 1.0 : -1.0;
      FixedPlane plane{};
      plane.part = index;
      double offset = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double n = sign * fixed.R_WB[3 * k + axis];
        plane.normal[k] = static_cast<Real>(n);
        offset += n * part.center[k];
      }
      if (box) fixed.full_half[axis] = part.half[axis] + part.radius;
      plane.offset = static_cast<Real>(offset + fixed.full_half[axis]);
      lanes.planes.push_back(plane);
    }
    fixed.shape = std::move(part);
    lanes.fixed.push_back(std::move(fixed));
  }
}

}  // namespace

core::Status validate(const LockstepOptions& options) {
  const auto in = [](double value, double low, double high) { return value >= low && value <= high; };
  if (!in(options.step, 1e-4, 0.02)) return core::invalid_input("step must be in [1e-4, 0.02] s");
  if (options.solver_iterations < 1 || options.solver_iterations > 1000) {
    return core::invalid_input("solver_iterations must be in [1, 1000]");
  }
  if (!in(options.solver_accuracy, 1e-7, 1.0)) return core::invalid_input("solver_accuracy must be in [1e-7, 1] m/s");
  if (!in(options.overlap_recovery, 1e-6, 1.0)) return core::invalid_input("overlap_recovery must be in [1e-6, 1]");
  if (!in(options.restitution_speed, 0.0, 100.0)) {
    return core::invalid_input("restitution_speed must be in [0, 100] m/s");
  }
  if (!in(options.impact_speed, 0.0, 100.0)) return core::invalid_input("impact_speed must be in [0, 100] m/s");
  if (!in(options.edge_rounding, 1e-5, 0.01)) return core::invalid_input("edge_rounding must be in [1e-5, 0.01] m");
  if (!in(options.touching_distance, 0.0, 0.1)) return core::invalid_input("touching_distance must be in [0, 0.1] m");
  if (!in(options.contact_merge_time, 0.0, 10.0)) return core::invalid_input("contact_merge_time must be in [0, 10] s");
  if (!in(options.rest.energy, 0.0, 1e3)) return core::invalid_input("rest.energy must be in [0, 1000] J/kg");
  if (!in(options.rest.time, 0.0, 1e3)) return core::invalid_input("rest.time must be in [0, 1000] s");
  if (options.live_instances < 1 || options.live_instances > 1024) {
    return core::invalid_input("live_instances must be in [1, 1024]");
  }
  return core::ok_status();
}

core::Status lockstep_supports(const RunRequest& request, std::span<const belief::WorldState> starts) {
  if (!request.actions.empty()) {
    return core::unsupported("the action " + belief::kind_of(request.actions.front()) +
                             " is not simulated in lockstep; use the Bullet stepper");
  }
  for (const belief::WorldState& start : starts) {
    for (const belief::ObjectState& object : start.objects) {
      if (object.mode == belief::MotionMode::kHeld) {
        return core::unsupported("a start holds the object, which is not simulated in lockstep");
      }
    }
  }
  return core::ok_status();
}

core::Result<std::shared_ptr<const CompiledLockstep>> compile_lockstep(const belief::Scene& scene, ShapeStore& shapes,
                                                                       const LockstepOptions& options) {
  PRESCENE_RETURN_IF_ERROR(validate(options));
  PRESCENE_RETURN_IF_ERROR(belief::validate(scene));
  PRESCENE_RETURN_IF_ERROR(check_bodies(scene));
  auto compiled = std::make_shared<CompiledLockstep>();
  compiled->scene = scene;
  compiled->options = options;
  LockstepScene& lanes = compiled->lanes;
  lanes.settings = {options.step,
                    plain(scene.gravity_W),
                    options.solver_iterations,
                    options.solver_accuracy,
                    options.overlap_recovery,
                    options.restitution_speed,
                    options.impact_speed};

  const belief::SceneObject& object = scene.objects.front();
  const belief::ObjectModel& model = scene.model_of(object);
  geometry::MassProperties unit;
  unit.mass = 1.0;
  unit.I_BBcm_B = model.unit_inertia;
  const geometry::PrincipalInertia principal = geometry::principal_inertia(unit);
  lanes.unit_moments = plain(principal.moments);
  compiled->R_OP = geometry::Quaterniond(principal.R_BP).normalized();
  lanes.rolling_arm = model.contact.rolling_friction;
  const auto rounding = [&](const belief::ContactProperties& contact) {
    return std::max(options.edge_rounding, contact.edge_radius);
  };
  const Pose X_PO{compiled->R_OP.conjugate(), Vector3d::Zero()};
  PRESCENE_RETURN_IF_ERROR(add_shapes(object.name, model.collision, X_PO, rounding(model.contact), shapes,
                                      options.decomposition, lanes.parts));
  if (lanes.parts.size() > kMostParts) {
    return core::unsupported(object.name + " has " + std::to_string(lanes.parts.size()) + " convex parts, more than " +
                             std::to_string(kMostParts) + ", which are not simulated in lockstep");
  }
  for (const ConvexPart& part : lanes.parts) {
    const Vector3d reach = Vector3d(part.center[0], part.center[1], part.center[2]).cwiseAbs() +
                           Vector3d(part.box_half[0], part.box_half[1], part.box_half[2]);
    lanes.radius = std::max(lanes.radius, reach.norm());
  }

  const Vector3d origin = belief::mean_start(scene).objects.front().X_WO.translation;
  lanes.origin = plain(origin);
  for (std::size_t i = 0; i < scene.supports.size(); ++i) {
    const belief::Support& support = scene.supports[i];
    std::vector<ConvexPart> parts;
    const Pose X_LS{support.X_WS.rotation, support.X_WS.translation - origin};
    PRESCENE_RETURN_IF_ERROR(add_shapes(support.name, support.collision, X_LS, rounding(support.contact), shapes,
                                        options.decomposition, parts));
    for (const ConvexPart& part : parts) {
      if (part.kind != CoreKind::kBox && part.kind != CoreKind::kHull) {
        return core::unsupported(support.name + " has a round shape; only boxes and hulls are fixed in lockstep");
      }
    }
    add_fixed(support, 1 + static_cast<int>(i), std::move(parts), lanes);
  }
  if (lanes.fixed.size() > kMostFixed) {
    return core::unsupported("the supports have " + std::to_string(lanes.fixed.size()) + " convex parts, more than " +
                             std::to_string(kMostFixed) + ", which are not simulated in lockstep");
  }
  return std::shared_ptr<const CompiledLockstep>(std::move(compiled));
}

}  // namespace prescene::simulation
