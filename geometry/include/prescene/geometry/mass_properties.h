// SPDX-License-Identifier: Apache-2.0
// Volume, centre of mass and inertia of solids of uniform density.
#pragma once

#include "prescene/geometry/primitives.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry {

/// Mass (kg), centre of mass in the body frame B (m), rotational inertia about the centre of mass expressed in B (kg
/// m^2).
struct MassProperties {
  double mass = 0.0;
  Vector3d p_BoBcm = Vector3d::Zero();
  Matrix3d I_BBcm_B = Matrix3d::Zero();

  friend bool operator==(const MassProperties&, const MassProperties&) = default;
  /// Positive mass, finite, inertia symmetric positive definite and obeying the triangle inequality of moments.
  bool is_physical() const;
};

/// Of the solid inside a closed, oriented mesh, by integrals over its faces [Mirtich 1996; Eberly 2002]. Fails with
/// kInvalidInput when the mesh does not bound a volume (holes, triangles of mixed orientation) or its signed volume is
/// not positive (the message says which).
core::Result<MassProperties> mass_properties(const TriangleMesh& mesh, double density);
/// Signed volume by the divergence theorem, m^3; without meaning for open meshes.
double signed_volume(const TriangleMesh& mesh);

MassProperties mass_properties(const Primitive& primitive, double density);
/// Sum of two bodies fixed to each other in the same frame.
MassProperties combined(const MassProperties& a, const MassProperties& b);
/// The same body seen from another frame A.
MassProperties transformed(const MassProperties& body_in_B, const Pose& X_AB);
/// The same body with its mass set to `mass` (> 0) and inertia scaled in proportion.
MassProperties with_mass(const MassProperties& body, double mass);
/// Principal moments (ascending) and the rotation R_BP whose columns are the principal axes (right-handed).
struct PrincipalInertia {
  Vector3d moments;
  Matrix3d R_BP;
};
PrincipalInertia principal_inertia(const MassProperties& body);

}  // namespace prescene::geometry
