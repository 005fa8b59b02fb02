// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/mass_properties.h"

#include <cmath>
#include <numbers>
#include <string>

#include "prescene/core/check.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::geometry {
namespace {

// Inertia about the origin from the second moments integral(x x^T).
Matrix3d inertia_of_moments(const Matrix3d& second_moments) {
  return second_moments.trace() * Matrix3d::Identity() - second_moments;
}

// Inertia of a point of unit mass at p: |p|^2 1 - p p^T.
Matrix3d point_inertia(const Vector3d& p) { return inertia_of_moments(p * p.transpose()); }

// Integrals of 1, x and x x^T over the inside of a closed mesh, coordinates relative to `origin`.
struct VolumeIntegrals {
  double volume = 0.0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
};

// By the divergence theorem each integral is one of a polynomial over the surface, which has a closed form on a
// triangle in terms of the complete symmetric polynomials of its corners' coordinates [Eberly 2002].
VolumeIntegrals volume_integrals(const TriangleMesh& mesh, const Vector3d& origin) {
  VolumeIntegrals sum;
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices[t[0]] - origin;
    const Vector3d b = mesh.vertices[t[1]] - origin;
    const Vector3d c = mesh.vertices[t[2]] - origin;
    const Vector3d d = (b - a).cross(c - a);
    const Vector3d h1 = a + b + c;
    const Vector3d h2 = a.cwiseProduct(a) + b.cwiseProduct(a + b) + c.cwiseProduct(h1);
    const Vector3d h3 = a.cwiseProduct(a.cwiseProduct(a)) + b.cwiseProduct(a.cwiseProduct(a) + b.cwiseProduct(a + b)) +
                        c.cwiseProduct(h2);
    sum.volume += d.x() * h1.x() / 6.0;
    sum.first += d.cwiseProduct(h2) / 24.0;
    sum.second.diagonal() += d.cwiseProduct(h3) / 60.0;
    const Vector3d ga = h2 + a.cwiseProduct(h1 + a);
    const Vector3d gb = h2 + b.cwiseProduct(h1 + b);
    const Vector3d gc = h2 + c.cwiseProduct(h1 + c);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3;
      sum.second(i, j) += d[i] * (a[j] * ga[i] + b[j] * gb[i] + c[j] * gc[i]) / 120.0;
    }
  }
  for (int i = 0; i < 3; ++i) sum.second((i + 1) % 3, i) = sum.second(i, (i + 1) % 3);
  return sum;
}

// A point inside the bounding box, so that the integrals do not lose digits on a mesh far from its origin.
Vector3d inner_point(const TriangleMesh& mesh) {
  if (mesh.vertices.empty()) return Vector3d::Zero();
  return bounding_box(mesh).center();
}

MassProperties about_axis(double mass, double z, double across, double along) {
  return {mass, Vector3d(0.0, 0.0, z), Vector3d(across, across, along).asDiagonal()};
}

struct PrimitiveMass {
  double density;

  MassProperties operator()(const Sphere& s) const {
    const double mass = density * 4.0 / 3.0 * std::numbers::pi * s.radius * s.radius * s.radius;
    const double moment = 0.4 * mass * s.radius * s.radius;
    return about_axis(mass, 0.0, moment, moment);
  }
  MassProperties operator()(const BoxShape& b) const {
    const double mass = density * b.size.prod();
    const Vector3d second = mass / 12.0 * b.size.cwiseProduct(b.size);
    return {mass, Vector3d::Zero(), inertia_of_moments(second.asDiagonal())};
  }
  MassProperties operator()(const Cylinder& c) const {
    const double r2 = c.radius * c.radius;
    const double mass = density * std::numbers::pi * r2 * c.length;
    return about_axis(mass, 0.0, mass * (3.0 * r2 + c.length * c.length) / 12.0, 0.5 * mass * r2);
  }
  MassProperties operator()(const Capsule& c) const {
    const double r = c.radius;
    const double r2 = r * r;
    const double cylinder = density * std::numbers::pi * r2 * c.length;
    const double ends = density * 4.0 / 3.0 * std::numbers::pi * r2 * r;  // Both half spheres.
    // A half sphere's centre of mass is 3/8 r above its base; about the base's centre its moments are a sphere's
    // halved.
    const double across = cylinder * (3.0 * r2 + c.length * c.length) / 12.0 +
                          ends * (0.4 * r2 + 0.25 * c.length * c.length + 0.375 * c.length * r);
    return about_axis(cylinder + ends, 0.0, across, 0.5 * cylinder * r2 + 0.4 * ends * r2);
  }
  MassProperties operator()(const Cone& c) const {
    const double r2 = c.radius * c.radius;
    const double mass = density * std::numbers::pi * r2 * c.length / 3.0;
    const double across = mass * (0.15 * r2 + 0.0375 * c.length * c.length);
    return about_axis(mass, -0.25 * c.length, across, 0.3 * mass * r2);
  }
};

}  // namespace

bool MassProperties::is_physical() const {
  if (!(std::isfinite(mass) && mass > 0.0 && p_BoBcm.allFinite() && I_BBcm_B.allFinite())) return false;
  const double scale = I_BBcm_B.cwiseAbs().maxCoeff();
  // Rounding of the sums that made the inertia; flat bodies sit exactly on the triangle inequality.
  const double tolerance = 1e-9 * scale;
  if ((I_BBcm_B - I_BBcm_B.transpose()).cwiseAbs().maxCoeff() > tolerance) return false;
  const Vector3d moments = principal_inertia(*this).moments;
  return moments[0] > 0.0 && moments[0] + moments[1] >= moments[2] - tolerance;
}

core::Result<MassProperties> mass_properties(const TriangleMesh& mesh, double density) {
  PRESCENE_CHECK(std::isfinite(density) && density > 0.0);
  const MeshTopology topology = mesh_topology(mesh);
  if (mesh.empty()) return core::invalid_input("the mesh has no triangles, so it has no mass");
  if (!topology.bounds_volume()) {
    return core::invalid_input(
        "the mesh does not enclose a volume: " + std::to_string(topology.open_edges) +
        " edges have one triangle only, " + std::to_string(topology.inconsistent_edges) +
        " are between triangles of opposite orientation, " + std::to_string(topology.non_manifold_edges) +
        " have more than two triangles; close the mesh, or give mass, centre of mass and inertia");
  }
  const Vector3d origin = inner_point(mesh);
  const VolumeIntegrals integrals = volume_integrals(mesh, origin);
  if (!(integrals.volume > 0.0)) {
    return core::invalid_input("the mesh encloses " + std::to_string(integrals.volume) +
                               " m^3: its triangles are clockwise seen from outside (turn them around), or it is flat");
  }
  const Vector3d centre = integrals.first / integrals.volume;
  MassProperties result;
  result.mass = density * integrals.volume;
  result.p_BoBcm = origin + centre;
  const Matrix3d central = integrals.second - integrals.volume * centre * centre.transpose();
  result.I_BBcm_B = density * inertia_of_moments(central);
  return result;
}

double signed_volume(const TriangleMesh& mesh) {
  const Vector3d origin = inner_point(mesh);
  double six_volumes = 0.0;
  for (const auto& t : mesh.triangles) {
    six_volumes +=
        (mesh.vertices[t[0]] - origin).dot((mesh.vertices[t[1]] - origin).cross(mesh.vertices[t[2]] - origin));
  }
  return six_volumes / 6.0;
}

MassProperties mass_properties(const Primitive& primitive, double density) {
  return std::visit(PrimitiveMass{density}, primitive);
}

MassProperties combined(const MassProperties& a, const MassProperties& b) {
  MassProperties sum;
  sum.mass = a.mass + b.mass;
  sum.p_BoBcm = (a.mass * a.p_BoBcm + b.mass * b.p_BoBcm) / sum.mass;
  sum.I_BBcm_B = a.I_BBcm_B + b.I_BBcm_B + a.mass * point_inertia(a.p_BoBcm - sum.p_BoBcm) +
                 b.mass * point_inertia(b.p_BoBcm - sum.p_BoBcm);
  return sum;
}

MassProperties transformed(const MassProperties& body_in_B, const Pose& X_AB) {
  const Matrix3d R_AB = X_AB.rotation.toRotationMatrix();
  return {body_in_B.mass, X_AB * body_in_B.p_BoBcm, R_AB * body_in_B.I_BBcm_B * R_AB.transpose()};
}

MassProperties with_mass(const MassProperties& body, double mass) {
  PRESCENE_CHECK(mass > 0.0 && body.mass > 0.0);
  return {mass, body.p_BoBcm, (mass / body.mass) * body.I_BBcm_B};
}

PrincipalInertia principal_inertia(const MassProperties& body) {
  const auto [moments, axes] = symmetric_eigen_3(0.5 * (body.I_BBcm_B + body.I_BBcm_B.transpose()));
  PrincipalInertia result{moments, axes};
  // An eigenvector's sign is free: the largest component is made positive, then the third axis right-handed.
  for (int i = 0; i < 2; ++i) {
    Eigen::Index largest = 0;
    result.R_BP.col(i).cwiseAbs().maxCoeff(&largest);
    if (result.R_BP(largest, i) < 0.0) result.R_BP.col(i) *= -1.0;
  }
  result.R_BP.col(2) = result.R_BP.col(0).cross(result.R_BP.col(1));
  return result;
}

}  // namespace prescene::geometry
