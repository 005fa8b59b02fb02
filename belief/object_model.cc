// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/object_model.h"

#include <cmath>

#include "prescene/belief/validation.h"
#include "prescene/core/check.h"

namespace prescene::belief {
namespace {

core::Result<geometry::MassProperties> solid_of(const MeshShape& shape, double density) {
  const geometry::TriangleMesh& mesh = *shape.mesh;
  switch (shape.use) {
    case MeshUse::kConvexHull: {
      PRESCENE_TRY(const geometry::TriangleMesh hull, geometry::convex_hull(mesh.vertices));
      return geometry::mass_properties(hull, density);
    }
    case MeshUse::kConvexParts: {
      std::optional<geometry::MassProperties> sum;
      for (const geometry::TriangleMesh& part : geometry::connected_components(mesh)) {
        PRESCENE_TRY(const geometry::TriangleMesh hull, geometry::convex_hull(part.vertices));
        PRESCENE_TRY(const geometry::MassProperties solid, geometry::mass_properties(hull, density));
        sum = sum ? geometry::combined(*sum, solid) : solid;
      }
      if (!sum) return core::invalid_input("the mesh has no triangles: give a mesh with a surface");
      return *sum;
    }
    case MeshUse::kDecompose:
    case MeshUse::kSurface:
    case MeshUse::kSpheres:
      return geometry::mass_properties(mesh, density);
  }
  PRESCENE_CHECK_MSG(false, "a MeshUse outside of its enumeration");
}

}  // namespace

bool operator==(const PrimitiveShape& a, const PrimitiveShape& b) {
  return a.primitive == b.primitive && a.X_OS == b.X_OS;
}

bool operator==(const MeshShape& a, const MeshShape& b) {
  return same_mesh(a.mesh, b.mesh) && a.X_OS == b.X_OS && a.use == b.use && a.spheres == b.spheres;
}

bool operator==(const ObjectModel& a, const ObjectModel& b) {
  return a.name == b.name && a.collision == b.collision && same_mesh(a.visual, b.visual) &&
         geometry::same_look(a.look, b.look) && a.mass == b.mass && a.center_of_mass == b.center_of_mass &&
         a.unit_inertia == b.unit_inertia && a.contact == b.contact && a.symmetry == b.symmetry &&
         a.surface == b.surface && a.color == b.color && a.learn_colors == b.learn_colors && a.hollow == b.hollow;
}

geometry::TriangleMesh collision_mesh(const std::vector<CollisionShape>& shapes) {
  geometry::TriangleMesh mesh;
  for (const CollisionShape& shape : shapes) {
    if (const auto* primitive = std::get_if<PrimitiveShape>(&shape)) {
      mesh = geometry::joined(mesh, geometry::transformed(geometry::make_mesh(primitive->primitive), primitive->X_OS));
    } else {
      const auto& of_mesh = std::get<MeshShape>(shape);
      mesh = geometry::joined(mesh, geometry::transformed(*of_mesh.mesh, of_mesh.X_OS));
    }
  }
  return mesh;
}

geometry::TriangleMesh collision_mesh(const ObjectModel& model) { return collision_mesh(model.collision); }

core::Result<geometry::MassProperties> mass_properties(const CollisionShape& shape, double density) {
  if (const auto* primitive = std::get_if<PrimitiveShape>(&shape))
    return geometry::transformed(geometry::mass_properties(primitive->primitive, density), primitive->X_OS);
  const auto& of_mesh = std::get<MeshShape>(shape);
  PRESCENE_TRY(const geometry::MassProperties solid, solid_of(of_mesh, density));
  return geometry::transformed(solid, of_mesh.X_OS);
}

core::Result<ObjectModel> with_derived_properties(ObjectModel model) {
  if (model.collision.empty())
    return core::invalid_input("model '" + model.name + "': it has no shape: give a primitive or a mesh");
  std::optional<geometry::MassProperties> sum;
  for (const CollisionShape& shape : model.collision) {
    const core::Result<geometry::MassProperties> solid = mass_properties(shape, 1000.0);
    if (!solid) return solid.status().at("model '" + model.name + "'");
    sum = sum ? geometry::combined(*sum, *solid) : *solid;
  }
  const geometry::MassProperties unit = geometry::with_mass(*sum, 1.0);
  model.center_of_mass = Vector3Distribution::fixed(unit.p_BoBcm);
  model.unit_inertia = unit.I_BBcm_B;
  if (!model.visual) model.visual = std::make_shared<geometry::TriangleMesh>(collision_mesh(model));
  return model;
}

core::Status validate(const ObjectModel& model) {
  const std::string place = "model '" + model.name + "'";
  PRESCENE_RETURN_IF_ERROR(check_name(model.name).at(place));
  PRESCENE_RETURN_IF_ERROR(check_shapes(model.collision).at(place));
  PRESCENE_RETURN_IF_ERROR(check_scalar(model.mass, kMassRange).at("mass").at(place));
  const Vector3Distribution& center = model.center_of_mass;
  for (const ScalarDistribution* coordinate : {&center.x, &center.y, &center.z})
    PRESCENE_RETURN_IF_ERROR(check_scalar(*coordinate, kLengthRange).at("center_of_mass").at(place));
  const geometry::MassProperties unit{1.0, Vector3d::Zero(), model.unit_inertia};
  if (!unit.is_physical())
    return core::invalid_input(
               "no body has this inertia: give a symmetric, positive definite matrix about the centre of mass in which "
               "no "
               "principal moment exceeds the sum of the others")
        .at("unit_inertia")
        .at(place);
  PRESCENE_RETURN_IF_ERROR(check_contact(model.contact).at(place));
  return check_color(model.color).at(place);
}

}  // namespace prescene::belief
