// SPDX-License-Identifier: Apache-2.0
#include "compile_scene.h"

#include <algorithm>
#include <string>

#include "convex_parts.h"
#include "prescene/belief/validation.h"
#include "prescene/core/hash.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/simulation/rules/contact_rules.h"
#include "prescene/simulation/rules/mechanics_hash.h"

namespace prescene::simulation {
namespace {

using geometry::Matrix3d;
using geometry::Pose;

constexpr std::size_t kMostParts = 16;
constexpr std::size_t kMostFixed = 256;
constexpr std::size_t kMostRobotBodies = 32;
constexpr std::size_t kMostPushers = 16;

core::Status check_count(const std::string& what, std::size_t count, std::size_t most) {
  if (count <= most) return core::ok_status();
  return core::unsupported(what + " " + std::to_string(count) + " convex parts, more than " + std::to_string(most) +
                           ", which are not simulated in lockstep");
}

/// What contacts take from a part's body; objects bring frictions and restitution with each start.
PartId part_id(int number, const SurfaceCoefficients& surface) {
  PartId id;
  id.number = number;
  id.friction = static_cast<Real>(surface.friction);
  id.impact_friction = static_cast<Real>(surface.impact_friction);
  id.restitution = static_cast<Real>(surface.restitution);
  id.rolling_arm = static_cast<Real>(surface.rolling_arm);
  return id;
}

void add_part(PartId id, int body, std::size_t part, const ConvexPart& shape, LockstepScene& lanes) {
  id.body = body;
  id.part = static_cast<int>(part);
  lanes.rolls = lanes.rolls || id.rolling_arm > 0;
  lanes.has_spheres = lanes.has_spheres || shape.kind == CoreKind::kSpheres;
  lanes.parts.push_back(id);
}

void add_fixed(const PartId& id, std::vector<ConvexPart> parts, LockstepScene& lanes) {
  for (ConvexPart& part : parts) {
    FixedPart fixed;
    const bool box = part.kind == CoreKind::kBox;
    const int index = static_cast<int>(lanes.fixed.size());
    for (int face = 0; face < 6; ++face) {
      // Kept for other shapes, too, so that planes are found by the part's index.
      const auto axis = static_cast<std::size_t>(face / 2);
      const double sign = face % 2 == 0 ? 1.0 : -1.0;
      FixedPlane plane{};
      plane.part = index;
      double offset = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double n = sign * part.R_PS[3 * k + axis];
        plane.normal[k] = static_cast<Real>(n);
        offset += n * part.center[k];
      }
      if (box) fixed.full_half[axis] = part.half[axis] + part.radius;
      plane.offset = static_cast<Real>(offset + fixed.full_half[axis]);
      lanes.planes.push_back(plane);
    }
    fixed.shape = std::move(part);
    add_part(id, -1, lanes.fixed.size(), fixed.shape, lanes);
    lanes.fixed.push_back(std::move(fixed));
  }
}

void add_body(const PartId& id, LaneBody body, LockstepScene& lanes) {
  body.number = id.number;
  body.rolling_arm = id.rolling_arm;
  for (const ConvexPart& part : body.parts) {
    const Vector3d reach = Vector3d(part.center[0], part.center[1], part.center[2]).cwiseAbs() +
                           Vector3d(part.box_half[0], part.box_half[1], part.box_half[2]);
    body.radius = std::max(body.radius, reach.norm());
  }
  lanes.first_part.push_back(static_cast<int>(lanes.parts.size()));
  const auto index = static_cast<int>(lanes.bodies.size());
  for (std::size_t i = 0; i < body.parts.size(); ++i) add_part(id, index, i, body.parts[i], lanes);
  lanes.bodies.push_back(std::move(body));
}

/// Builds a scene's bodies one after the other.
class Compiler {
 public:
  Compiler(CompiledLockstep& compiled, ShapeStore& shapes)
      : compiled_(compiled), scene_(compiled.scene), lanes_(compiled.lanes), shapes_(shapes) {}

  core::Status add_supports();
  core::Status add_objects();
  core::Status add_robot();

 private:
  core::Status add_parts(const std::string& name, const std::vector<belief::CollisionShape>& collision,
                         const belief::ContactProperties& contact, const Pose& X_LB, std::vector<ConvexPart>& parts) {
    const double rounding = std::max(compiled_.options.edge_rounding, contact.edge_radius);
    core::Status status = add_shapes(name, collision, X_LB, rounding, shapes_, compiled_.options.decomposition, parts);
    for (const ConvexPart& part : parts) compiled_.hull_error = std::max(compiled_.hull_error, part.hull_error);
    return status;
  }
  int supports_begin() const { return static_cast<int>(scene_.objects.size()); }
  int robot_begin() const { return supports_begin() + static_cast<int>(scene_.supports.size()); }

  CompiledLockstep& compiled_;
  const belief::Scene& scene_;
  LockstepScene& lanes_;
  ShapeStore& shapes_;
};

core::Status Compiler::add_supports() {
  const Vector3d origin(lanes_.origin[0], lanes_.origin[1], lanes_.origin[2]);
  for (std::size_t i = 0; i < scene_.supports.size(); ++i) {
    const belief::Support& support = scene_.supports[i];
    const Pose X_LS{support.X_WS.rotation, support.X_WS.translation - origin};
    std::vector<ConvexPart> parts;
    PRESCENE_RETURN_IF_ERROR(add_parts(support.name, support.collision, support.contact, X_LS, parts));
    add_fixed(part_id(supports_begin() + static_cast<int>(i), mean_coefficients(support.contact)), std::move(parts),
              lanes_);
  }
  return check_count("the supports have", lanes_.fixed.size(), kMostFixed);
}

core::Status Compiler::add_objects() {
  for (std::size_t i = 0; i < scene_.objects.size(); ++i) {
    const belief::SceneObject& object = scene_.objects[i];
    const belief::ObjectModel& model = scene_.model_of(object);
    geometry::MassProperties unit;
    unit.mass = 1.0;
    unit.I_BBcm_B = model.unit_inertia;
    const geometry::PrincipalInertia principal = geometry::principal_inertia(unit);
    const auto R_OP = geometry::Quaterniond(principal.R_BP).normalized();
    compiled_.R_OP.push_back(R_OP);
    LaneBody body;
    body.unit_moments = plain(principal.moments);
    body.spin_rates = spin_rates(principal.moments, compiled_.options.step);
    body.uneven_axes = uneven_axes(principal.moments);
    const Pose X_PO{R_OP.conjugate(), Vector3d::Zero()};
    PRESCENE_RETURN_IF_ERROR(add_parts(object.name, model.collision, model.contact, X_PO, body.parts));
    PRESCENE_RETURN_IF_ERROR(check_count(object.name + " has", body.parts.size(), kMostParts));
    add_body(part_id(static_cast<int>(i), mean_coefficients(model.contact)), std::move(body), lanes_);
  }
  lanes_.objects = static_cast<int>(scene_.objects.size());
  return core::ok_status();
}

core::Status Compiler::add_robot() {
  for (std::size_t i = 0; i < scene_.robot.size(); ++i) {
    const belief::KinematicBody& robot = scene_.robot[i];
    compiled_.robot_bodies.push_back(robot.collision.empty() ? -1 : static_cast<int>(lanes_.bodies.size()));
    if (robot.collision.empty()) continue;
    if (lanes_.bodies.size() >= static_cast<std::size_t>(lanes_.objects) + kMostRobotBodies) {
      return core::unsupported(robot.name + " is one robot body with a shape more than the " +
                               std::to_string(kMostRobotBodies) + " that are simulated in lockstep");
    }
    LaneBody body;
    PRESCENE_RETURN_IF_ERROR(add_parts(robot.name, robot.collision, robot.contact, Pose{}, body.parts));
    PRESCENE_RETURN_IF_ERROR(check_count(robot.name + " has", body.parts.size(), kMostParts));
    add_body(part_id(robot_begin() + static_cast<int>(i), mean_coefficients(robot.contact)), std::move(body), lanes_);
  }
  return core::ok_status();
}

}  // namespace

core::Status validate(const LockstepOptions& options) {
  PRESCENE_RETURN_IF_ERROR(validate(static_cast<const MechanicsOptions&>(options)));
  if (!(options.solver_accuracy >= 1e-7 && options.solver_accuracy <= 1.0)) {
    return core::invalid_input("solver_accuracy must be in [1e-7, 1] m/s");
  }
  if (options.live_instances < 1 || options.live_instances > 1024) {
    return core::invalid_input("live_instances must be in [1, 1024]");
  }
  return core::ok_status();
}

core::Status check_actions(const std::vector<belief::Action>& actions) {
  for (const belief::Action& action : actions) {
    const bool drives = std::holds_alternative<belief::Pull>(action.what) ||
                        std::holds_alternative<belief::MoveJoint>(action.what) ||
                        std::holds_alternative<belief::Insert>(action.what);
    if (drives) return core::unsupported("the action " + belief::kind_of(action) + " is not simulated in lockstep");
  }
  const std::size_t pushers = pusher_radii(actions).size();
  if (pushers <= kMostPushers) return core::ok_status();
  return core::unsupported(std::to_string(pushers) + " push actions are more than the " + std::to_string(kMostPushers) +
                           " that are simulated in lockstep");
}

std::vector<double> pusher_radii(const std::vector<belief::Action>& actions) {
  std::vector<double> radii;
  for (const belief::Action& action : actions) {
    if (const auto* push = std::get_if<belief::Push>(&action.what)) radii.push_back(push->radius);
  }
  return radii;
}

std::shared_ptr<const CompiledLockstep> with_pushers(const CompiledLockstep& compiled,
                                                     const std::vector<double>& radii) {
  auto more = std::make_shared<CompiledLockstep>(compiled);
  more->pushers = radii;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    LaneBody body;
    body.parts.push_back(convex_part(geometry::Sphere{radii[i]}, compiled.options.edge_rounding));
    const std::size_t number =
        compiled.scene.objects.size() + compiled.scene.supports.size() + compiled.scene.robot.size() + i;
    add_body(part_id(static_cast<int>(number), kPusherSurface), std::move(body), more->lanes);
  }
  return more;
}

core::Result<std::shared_ptr<const CompiledLockstep>> compile_lockstep(const belief::Scene& scene, ShapeStore& shapes,
                                                                       const LockstepOptions& options) {
  PRESCENE_RETURN_IF_ERROR(validate(options));
  PRESCENE_RETURN_IF_ERROR(belief::validate(scene));
  if (scene.objects.empty() || scene.objects.size() > static_cast<std::size_t>(kMaxObjects)) {
    return core::unsupported("lockstep simulates one to " + std::to_string(kMaxObjects) +
                             " objects, and the scene has " + std::to_string(scene.objects.size()));
  }
  if (!scene.joints.empty())
    return core::unsupported("the joint " + scene.joints.front().name + " is not simulated in lockstep");
  PRESCENE_RETURN_IF_ERROR(check_actions(scene.actions));
  auto compiled = std::make_shared<CompiledLockstep>();
  compiled->scene = scene;
  compiled->options = options;
  LockstepScene& lanes = compiled->lanes;
  lanes.settings = {options.step,
                    plain(scene.gravity_W),
                    scene.gravity_W.norm(),
                    options.solver_iterations,
                    options.solver_accuracy,
                    options.overlap_recovery,
                    options.restitution_speed,
                    options.impact_speed};
  lanes.origin = plain(belief::mean_start(scene).objects.front().X_WO.translation);
  core::Hasher hasher;
  hasher.value(mechanics_hash(scene, options)).value(options.solver_accuracy);
  for (const double coordinate : lanes.origin) hasher.value(coordinate);
  compiled->hash = hasher.digest();
  Compiler compiler(*compiled, shapes);
  // Fixed parts come first, so that they are where the lanes' lists expect them.
  PRESCENE_RETURN_IF_ERROR(compiler.add_supports());
  PRESCENE_RETURN_IF_ERROR(compiler.add_objects());
  PRESCENE_RETURN_IF_ERROR(compiler.add_robot());
  return std::shared_ptr<const CompiledLockstep>(std::move(compiled));
}

}  // namespace prescene::simulation
