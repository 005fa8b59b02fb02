// SPDX-License-Identifier: Apache-2.0
#include "compiled_scene.h"

#include <algorithm>
#include <cmath>

#include "prescene/belief/validation.h"
#include "prescene/collision/spheres/surface_spheres.h"
#include "prescene/core/hash.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/simulation/rules/mechanics_hash.h"

namespace prescene::simulation {
namespace {

void set_bounds(Part& part, const Vector3d& low, const Vector3d& high) {
  const Vector3d center = 0.5 * (low + high);
  part.box_center = part.X_OS * center;
  part.box_half_size = part.X_OS.R.cwiseAbs() * (0.5 * (high - low));
}

Part convex_part(std::shared_ptr<const ConvexCore> core, const Pose& X_OS) {
  Part part;
  part.X_OS = Frame(X_OS);
  set_bounds(part, core->box_center() - core->box_half_size(), core->box_center() + core->box_half_size());
  part.core = std::move(core);
  return part;
}

/// What the shapes of all bodies are made with.
struct ShapeMaker {
  ShapeStore& shapes;
  const BulletOptions& options;
  bool spheres = false;  // some object collides as spheres
};

struct Cores {
  std::vector<std::shared_ptr<const ConvexCore>> all;
  double left_out = 0.0;  // m, the largest of their polytopes
};

/// Of the convex parts of a mesh. Each simulator of a scene takes the same ones, as moving their faces inwards takes
/// long.
core::Result<std::shared_ptr<const Cores>> cores_of(const belief::MeshShape& mesh, double rounding,
                                                    const ShapeMaker& maker) {
  const DecompositionSettings& settings = maker.options.decomposition;
  core::Hasher hasher;
  hasher.text("cores").value(mesh.use).value(rounding);
  hasher.value(settings.concavity).value(settings.min_parts).value(settings.max_part_vertices);
  PRESCENE_TRY(const ShapeStore::Made made,
               maker.shapes.made(mesh.mesh, hasher.digest(), [&]() -> core::Result<ShapeStore::Made> {
                 PRESCENE_TRY(const auto parts, maker.shapes.convex_parts(mesh.mesh, mesh.use, settings));
                 Cores cores;
                 for (const ConvexPolytope& polytope : *parts) {
                   cores.all.push_back(ConvexCore::from_polytope(polytope, rounding));
                   cores.left_out = std::max(cores.left_out, polytope.left_out);
                 }
                 return ShapeStore::Made(std::make_shared<const Cores>(std::move(cores)));
               }));
  return std::static_pointer_cast<const Cores>(made);
}

core::Result<std::shared_ptr<const SurfaceShape>> surface_of(const belief::MeshShape& mesh, const ShapeMaker& maker) {
  core::Hasher hasher;
  hasher.text("surface").value(maker.spheres);
  PRESCENE_TRY(const ShapeStore::Made made,
               maker.shapes.made(mesh.mesh, hasher.digest(), [&]() -> core::Result<ShapeStore::Made> {
                 PRESCENE_TRY(const auto prepared, maker.shapes.static_mesh(mesh.mesh));
                 return ShapeStore::Made(std::make_shared<const SurfaceShape>(prepared, maker.spheres));
               }));
  return std::static_pointer_cast<const SurfaceShape>(made);
}

core::Status add_shape(const belief::CollisionShape& shape, bool fixed, double rounding, const ShapeMaker& maker,
                       CompiledBody& body) {
  if (const auto* primitive = std::get_if<belief::PrimitiveShape>(&shape)) {
    body.parts.push_back(convex_part(ConvexCore::from_primitive(primitive->primitive, rounding), primitive->X_OS));
    return core::ok_status();
  }
  const auto& mesh = std::get<belief::MeshShape>(shape);
  if (!mesh.mesh) return core::invalid_input("a collision mesh is missing");
  if (mesh.use == belief::MeshUse::kSurface) {
    if (!fixed) {
      return core::unsupported(
          "a triangle surface can only be fixed or a robot body; use convex_hull, convex_parts, decompose or spheres "
          "for objects");
    }
    Part part;
    PRESCENE_TRY(part.surface, surface_of(mesh, maker));
    part.X_OS = Frame(mesh.X_OS);
    const geometry::Box box = geometry::facts_of(mesh.mesh).box;
    set_bounds(part, box.min(), box.max());
    body.parts.push_back(std::move(part));
    return core::ok_status();
  }
  if (mesh.use == belief::MeshUse::kSpheres) {
    Part part;
    PRESCENE_TRY(part.spheres, maker.shapes.surface_spheres(mesh.mesh, mesh.spheres));
    part.X_OS = Frame(mesh.X_OS);
    const geometry::Box box = geometry::facts_of(mesh.mesh).box;
    const Vector3d rise = Vector3d::Constant(static_cast<double>(part.spheres->rise));
    set_bounds(part, box.min() - rise, box.max() + rise);
    body.parts.push_back(std::move(part));
    return core::ok_status();
  }
  PRESCENE_TRY(const auto cores, cores_of(mesh, rounding, maker));
  for (const std::shared_ptr<const ConvexCore>& core : cores->all) body.parts.push_back(convex_part(core, mesh.X_OS));
  body.hull_error = std::max(body.hull_error, cores->left_out);
  return core::ok_status();
}

core::Result<CompiledBody> compile_body(const std::string& name, const std::vector<belief::CollisionShape>& collision,
                                        const belief::ContactProperties& contact, bool fixed, const ShapeMaker& maker) {
  CompiledBody body;
  body.name = name;
  body.surface = mean_coefficients(contact);
  const double rounding = std::max(maker.options.edge_rounding, contact.edge_radius);
  for (std::size_t i = 0; i < collision.size(); ++i) {
    const core::Status status = add_shape(collision[i], fixed, rounding, maker, body);
    if (!status.ok()) return status.at(name + ", shape " + std::to_string(i + 1));
  }
  for (const Part& part : body.parts) {
    body.radius = std::max(body.radius, (part.box_center.cwiseAbs() + part.box_half_size).norm());
  }
  return body;
}

CompiledJoint compile_joint(const belief::Joint& joint, const CompiledScene& compiled) {
  CompiledJoint result;
  result.joint = joint;
  result.child = *belief::find_object(compiled.scene, joint.child);
  if (const auto object = belief::find_object(compiled.scene, joint.parent)) {
    result.parent = *object;
  } else if (const auto support = belief::find_support(compiled.scene, joint.parent)) {
    result.parent = compiled.object_count + *support;
  }
  result.across_1_P = joint.axis_P.unitOrthogonal();
  result.across_2_P = joint.axis_P.cross(result.across_1_P);
  result.anchor_C = joint.X_PC0.inverse() * joint.anchor_P;
  result.arm = compiled.bodies[static_cast<std::size_t>(result.child)].radius;
  return result;
}

}  // namespace

core::Status validate(const BulletOptions& options) {
  PRESCENE_RETURN_IF_ERROR(validate(static_cast<const MechanicsOptions&>(options)));
  if (options.solver_accuracy >= 1e-15 && options.solver_accuracy <= 1.0) return core::ok_status();
  return core::invalid_input("solver_accuracy must be in [1e-15, 1] m/s");
}

core::Result<std::shared_ptr<const CompiledScene>> compile_scene(const belief::Scene& scene, ShapeStore& shapes,
                                                                 const BulletOptions& options) {
  PRESCENE_RETURN_IF_ERROR(validate(options));
  PRESCENE_RETURN_IF_ERROR(belief::validate(scene));
  auto compiled = std::make_shared<CompiledScene>();
  compiled->scene = scene;
  compiled->options = options;
  core::Hasher hasher;
  compiled->hash = hasher.value(mechanics_hash(scene, options)).value(options.solver_accuracy).digest();
  compiled->object_count = static_cast<int>(scene.objects.size());
  compiled->support_count = static_cast<int>(scene.supports.size());
  compiled->robot_count = static_cast<int>(scene.robot.size());
  ShapeMaker maker{shapes, options};
  for (const belief::SceneObject& object : scene.objects)
    maker.spheres = maker.spheres || collides_as_spheres(scene.model_of(object).collision);
  for (const belief::SceneObject& object : scene.objects) {
    const belief::ObjectModel& model = scene.model_of(object);
    PRESCENE_TRY(CompiledBody body, compile_body(object.name, model.collision, model.contact, false, maker));
    geometry::MassProperties unit;
    unit.mass = 1.0;
    unit.I_BBcm_B = model.unit_inertia;
    const geometry::PrincipalInertia principal = geometry::principal_inertia(unit);
    body.unit_moments = principal.moments;
    body.R_OP = principal.R_BP;
    compiled->bodies.push_back(std::move(body));
  }
  for (const belief::Support& support : scene.supports) {
    PRESCENE_TRY(CompiledBody body, compile_body(support.name, support.collision, support.contact, true, maker));
    body.X_WO = support.X_WS;
    compiled->bodies.push_back(std::move(body));
  }
  for (const belief::KinematicBody& robot : scene.robot) {
    PRESCENE_TRY(CompiledBody body, compile_body(robot.name, robot.collision, robot.contact, true, maker));
    compiled->bodies.push_back(std::move(body));
  }
  for (const belief::Joint& joint : scene.joints) compiled->joints.push_back(compile_joint(joint, *compiled));
  compiled->joint_order = belief::joint_order(scene);
  for (const CompiledBody& body : compiled->bodies)
    compiled->hull_error = std::max(compiled->hull_error, body.hull_error);
  return std::shared_ptr<const CompiledScene>(std::move(compiled));
}

}  // namespace prescene::simulation
