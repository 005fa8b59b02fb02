// SPDX-License-Identifier: Apache-2.0
// What a kind of object is: shapes, physical priors, symmetry and surface. Plain values.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "prescene/belief/distribution.h"
#include "prescene/geometry/mass_properties.h"
#include "prescene/geometry/mesh_look.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/symmetry.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::belief {

/// Meshes are shared, never changed: two models of one file hold the same one.
using MeshPtr = std::shared_ptr<const geometry::TriangleMesh>;
/// Whether both are the same triangles, or both null.
inline bool same_mesh(const MeshPtr& a, const MeshPtr& b) { return a == b || (a && b && *a == *b); }

/// A shape in the object's frame O.
struct PrimitiveShape {
  geometry::Primitive primitive;
  Pose X_OS;  ///< Where the primitive's own frame sits in O.
};
enum class MeshUse {
  kConvexHull,   ///< The hull of the mesh.
  kConvexParts,  ///< Each connected component is (about) convex: the hull of each.
  kDecompose,    ///< Approximate convex decomposition.
  kSurface,      ///< The triangles themselves: fixed things only.
  kSpheres,      ///< An inner sphere tree whose spheres touch the surface everywhere: closed meshes, with all hollows.
};
/// How finely spheres stand for a mesh; of MeshUse::kSpheres.
struct SphereSettings {
  int count = 3000;            ///< About; in [50, 100000].
  double edge_fidelity = 0.0;  ///< m; how far inside edges and corners may lie. 0: 0.3 % of the mesh's diagonal.
  friend bool operator==(const SphereSettings&, const SphereSettings&) = default;
};
struct MeshShape {
  MeshPtr mesh;
  Pose X_OS;
  MeshUse use = MeshUse::kConvexHull;
  SphereSettings spheres = {};
};
using CollisionShape = std::variant<PrimitiveShape, MeshShape>;
bool operator==(const PrimitiveShape& a, const PrimitiveShape& b);
/// Meshes compare by content.
bool operator==(const MeshShape& a, const MeshShape& b);

/// How the surface looks to a depth camera.
enum class SurfaceKind { kOpaque, kTransparent, kMirror };

struct Color {
  double r = 0.7, g = 0.7, b = 0.7;  ///< In [0, 1].
  friend bool operator==(const Color&, const Color&) = default;
};

/// Contact behaviour that an object brings; combined between two objects by product for friction and restitution.
struct ContactProperties {
  ScalarDistribution friction = FixedScalar{0.5};  ///< Coulomb coefficient while contacts slide; >= 0.
  /// Coefficient while a contact closes fast (an impact); empty = like `friction`.
  std::optional<ScalarDistribution> impact_friction;
  ScalarDistribution restitution = FixedScalar{0.1};  ///< Newton's coefficient of one contact, in [0, 1].
  double rolling_friction = 0.0;                      ///< Lever arm, m; >= 0.
  double edge_radius = 0.0;                           ///< Rounding of edges and corners, m; >= 0.
  friend bool operator==(const ContactProperties&, const ContactProperties&) = default;
};

/// The hollow of an open container as a box: what is in it is "inside".
struct Hollow {
  Pose X_OV;                         ///< Centre of the box in the container's frame.
  Vector3d size = Vector3d::Zero();  ///< Full edges, m.
  friend bool operator==(const Hollow&, const Hollow&) = default;
};

struct ObjectModel {
  std::string name;                       ///< Unique within a scene: letters, digits, '_', '-', '.'.
  std::vector<CollisionShape> collision;  ///< At least one.
  MeshPtr visual;          ///< In O; what the camera sees. Made from the collision shapes if none is given.
  geometry::LookPtr look;  ///< Of `visual`; null: all of `color`.
  ScalarDistribution mass = FixedScalar{1.0};                                         ///< kg, > 0
  Vector3Distribution center_of_mass = Vector3Distribution::fixed(Vector3d::Zero());  ///< p_OoOcm, m
  /// Inertia about the centre of mass in O for a mass of 1 kg (m^2).
  geometry::Matrix3d unit_inertia = geometry::Matrix3d::Identity();
  ContactProperties contact;
  geometry::SymmetryGroup symmetry;
  SurfaceKind surface = SurfaceKind::kOpaque;
  Color color;
  bool learn_colors = false;     ///< Tracked by the colours that frames show of it, too, not by depth alone.
  std::optional<Hollow> hollow;  ///< Of containers.

  friend bool operator==(const ObjectModel& a, const ObjectModel& b);
};

/// All shapes of a model as one mesh in O.
geometry::TriangleMesh collision_mesh(const ObjectModel& model);
/// The same for any list of shapes.
geometry::TriangleMesh collision_mesh(const std::vector<CollisionShape>& shapes);
/// The solid that a shape stands for at a density (kg/m^3): the primitive; the hull or hulls; else what the mesh
/// encloses, which fails with kInvalidInput where the mesh is not closed.
core::Result<geometry::MassProperties> mass_properties(const CollisionShape& shape, double density);
/// A copy whose centre of mass and unit inertia are those of its shapes at uniform density (overlaps count twice), and
/// whose visual mesh, if it had none, is made from them.
core::Result<ObjectModel> with_derived_properties(ObjectModel model);
/// Names, positive masses, friction >= 0, restitution in [0, 1], unit inertia physical: the message names the field.
core::Status validate(const ObjectModel& model);

}  // namespace prescene::belief
