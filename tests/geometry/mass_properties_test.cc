// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/mass_properties.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "prescene/core/random.h"
#include "tests/support/generators.h"
#include "tests/support/matchers.h"

namespace prescene::geometry {
namespace {

using testing::HasSubstr;
using tests::closed_meshes;
using tests::is_near;
using tests::poses;
using tests::primitives;

constexpr double kDensity = 730.0;

// Largest difference relative to the body's own mass and size.
double difference(const MassProperties& a, const MassProperties& b, double size) {
  return std::max({std::abs(a.mass - b.mass) / b.mass, (a.p_BoBcm - b.p_BoBcm).norm() / size,
                   (a.I_BBcm_B - b.I_BBcm_B).cwiseAbs().maxCoeff() / (b.mass * size * size)});
}

double size_of(const TriangleMesh& mesh) { return bounding_box(mesh).sizes().maxCoeff(); }

TEST(MassProperties, OfABoxByHand) {
  const MassProperties box = mass_properties(BoxShape{{0.2, 0.3, 0.6}}, 500.0);
  EXPECT_DOUBLE_EQ(box.mass, 18.0);
  EXPECT_THAT(box.I_BBcm_B, is_near(Matrix3d(Vector3d(1.5 * 0.45, 1.5 * 0.40, 1.5 * 0.13).asDiagonal()), 1e-14));
  EXPECT_TRUE(box.is_physical());
}

// A second method: the sum over tetrahedra between each triangle and a point, with the integrals of a tetrahedron
// worked out from its vertices: int x x^T = V / 20 (sum of v v^T + (sum of v)(sum of v)^T).
MassProperties by_tetrahedra(const TriangleMesh& mesh, double density, const Vector3d& apex) {
  double volume = 0.0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices[t[0]] - apex;
    const Vector3d b = mesh.vertices[t[1]] - apex;
    const Vector3d c = mesh.vertices[t[2]] - apex;
    const double v = a.dot(b.cross(c)) / 6.0;
    const Vector3d sum = a + b + c;
    volume += v;
    first += v / 4.0 * sum;
    second += v / 20.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  const Vector3d centre = first / volume;
  const Matrix3d central = second - volume * centre * centre.transpose();
  return {density * volume, apex + centre, density * (central.trace() * Matrix3d::Identity() - central)};
}

TEST(MassPropertiesLaws, FaceIntegralsAndTetrahedraAgree) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh mesh = *closed_meshes();
    const auto integrals = mass_properties(mesh, kDensity);
    RC_ASSERT(integrals.ok());
    RC_ASSERT(integrals->is_physical());
    RC_ASSERT(difference(*integrals, by_tetrahedra(mesh, kDensity, mesh.vertices[0]), size_of(mesh)) < 1e-11);
    RC_ASSERT(std::abs(signed_volume(mesh) * kDensity / integrals->mass - 1.0) < 1e-11);
  }));
}

TEST(MassPropertiesLaws, FineMeshesApproachTheClosedForms) {
  // Inscribed meshes of n segments miss a share of about 7 / n^2 of the volume and 15 / n^2 of the inertia.
  constexpr int kSegments = 128;
  EXPECT_TRUE(tests::check_law([] {
    const Primitive primitive = *primitives();
    const TriangleMesh mesh = make_mesh(primitive, kSegments);
    const auto of_mesh = mass_properties(mesh, kDensity);
    RC_ASSERT(of_mesh.ok());
    const MassProperties exact = mass_properties(primitive, kDensity);
    RC_ASSERT(exact.is_physical());
    const bool box = std::holds_alternative<BoxShape>(primitive);
    const double tolerance = box ? 1e-12 : 20.0 / (kSegments * kSegments);
    RC_ASSERT(difference(*of_mesh, exact, size_of(mesh)) < tolerance);
  }));
}

TEST(MassPropertiesLaws, MovingTheMeshMovesTheBody) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh mesh = *closed_meshes();
    const Pose X = *poses();
    const auto moved_mesh = mass_properties(transformed(mesh, X), kDensity);
    const auto body = mass_properties(mesh, kDensity);
    RC_ASSERT(moved_mesh.ok() && body.ok());
    RC_ASSERT(difference(*moved_mesh, transformed(*body, X), size_of(mesh)) < 1e-11);
  }));
}

TEST(MassPropertiesLaws, LengthsScaleMassByTheThirdAndInertiaByTheFifthPower) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh mesh = *closed_meshes();
    const double s = *tests::numbers(0.01, 10.0);
    const auto body = mass_properties(mesh, kDensity);
    const auto large = mass_properties(scaled(mesh, s), kDensity);
    RC_ASSERT(body.ok() && large.ok());
    const MassProperties expected{body->mass * std::pow(s, 3), s * body->p_BoBcm, std::pow(s, 5) * body->I_BBcm_B};
    RC_ASSERT(difference(*large, expected, s * size_of(mesh)) < 1e-11);
  }));
}

TEST(MassPropertiesLaws, TwoBodiesTogetherAreTheirJoinedMesh) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleMesh a = *closed_meshes();
    const TriangleMesh b = transformed(*closed_meshes(), Pose::from_translation({9.0, 1.0, -2.0}));
    const auto body_a = mass_properties(a, kDensity);
    const auto body_b = mass_properties(b, kDensity);
    const auto both = mass_properties(joined(a, b), kDensity);
    RC_ASSERT(body_a.ok() && body_b.ok() && both.ok());
    RC_ASSERT(difference(combined(*body_a, *body_b), *both, 10.0) < 1e-11);
    RC_ASSERT(difference(combined(*body_b, *body_a), *both, 10.0) < 1e-11);
  }));
}

TEST(MassPropertiesLaws, PrincipalAxesDiagonaliseTheInertia) {
  EXPECT_TRUE(tests::check_law([] {
    const auto body = mass_properties(*closed_meshes(), kDensity);
    RC_ASSERT(body.ok());
    const PrincipalInertia principal = principal_inertia(*body);
    RC_ASSERT(std::abs(principal.R_BP.determinant() - 1.0) < 1e-12);
    RC_ASSERT((principal.R_BP.transpose() * principal.R_BP - Matrix3d::Identity()).norm() < 1e-12);
    RC_ASSERT(principal.moments[0] <= principal.moments[1] && principal.moments[1] <= principal.moments[2]);
    const Matrix3d rebuilt = principal.R_BP * principal.moments.asDiagonal() * principal.R_BP.transpose();
    RC_ASSERT((rebuilt - body->I_BBcm_B).norm() < 1e-12 * body->I_BBcm_B.norm());
  }));
}

TEST(MassProperties, RandomPointsInsideAgree) {
  // A third method without any formula of a mesh: points thrown into the bounding box of a bin. Bound: 4.9 standard
  // errors.
  const Vector3d inner(0.4, 0.3, 0.2);
  constexpr double kWall = 0.05;
  const auto body = mass_properties(make_open_bin(inner, kWall), 1.0);
  ASSERT_TRUE(body.ok());
  core::RandomStream stream(1, core::Purpose::kTest);
  constexpr int kPoints = 400000;
  const Vector3d outer(0.5, 0.4, 0.25);
  int inside = 0;
  double sum_z = 0.0;
  double sum_zz = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const double x = stream.uniform(-0.25, 0.25);
    const double y = stream.uniform(-0.2, 0.2);
    const double z = stream.uniform(0.0, 0.25);
    const bool hollow = std::abs(x) < 0.2 && std::abs(y) < 0.15 && z > kWall;
    if (hollow) continue;
    ++inside;
    sum_z += z;
    sum_zz += (z - body->p_BoBcm.z()) * (z - body->p_BoBcm.z());
  }
  const double share = inside / static_cast<double>(kPoints);
  EXPECT_NEAR(share * outer.prod(), body->mass, 4.9 * std::sqrt(share * (1.0 - share) / kPoints) * outer.prod());
  EXPECT_NEAR(sum_z / inside, body->p_BoBcm.z(), 4.9 * 0.125 / std::sqrt(inside));
  // int z^2 dm is half the sum of the moments about x and y less that about z.
  const Matrix3d& I = body->I_BBcm_B;
  const double zz = 0.5 * (I(0, 0) + I(1, 1) - I(2, 2)) / body->mass;
  EXPECT_NEAR(sum_zz / inside, zz, 4.9 * zz * 2.0 / std::sqrt(inside));
}

TEST(MassProperties, KeepsItsDigitsFarFromTheOrigin) {
  const TriangleMesh mesh = make_mesh(Capsule{0.02, 0.1}, 16);
  const Pose X = Pose::from_translation({1000.0, -2000.0, 500.0});
  const auto near = mass_properties(mesh, kDensity);
  const auto far = mass_properties(transformed(mesh, X), kDensity);
  ASSERT_TRUE(near.ok() && far.ok());
  // The vertices themselves are rounded to 2e-13 m there.
  EXPECT_LT(difference(*far, transformed(*near, X), 0.1), 1e-9);
}

TEST(MassProperties, SaysWhyAMeshHasNone) {
  TriangleMesh open = make_mesh(BoxShape{{1.0, 1.0, 1.0}});
  open.triangles.pop_back();
  EXPECT_EQ(mass_properties(open, 1.0).status().code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(mass_properties(open, 1.0).status().message(), HasSubstr("3 edges have one triangle only"));

  TriangleMesh turned = make_mesh(BoxShape{{1.0, 1.0, 1.0}});
  std::swap(turned.triangles[4][0], turned.triangles[4][1]);
  EXPECT_THAT(mass_properties(turned, 1.0).status().message(), HasSubstr("3 are between triangles of opposite"));

  TriangleMesh inverted = make_mesh(BoxShape{{1.0, 1.0, 1.0}});
  for (auto& t : inverted.triangles) std::swap(t[0], t[1]);
  EXPECT_THAT(mass_properties(inverted, 1.0).status().message(), HasSubstr("clockwise"));
  EXPECT_THAT(mass_properties(TriangleMesh{}, 1.0).status().message(), HasSubstr("no triangles"));
}

TEST(MassProperties, WithMassScalesTheInertia) {
  const MassProperties body = mass_properties(Cone{0.1, 0.3}, kDensity);
  const MassProperties heavy = with_mass(body, 3.0 * body.mass);
  EXPECT_DOUBLE_EQ(heavy.mass, 3.0 * body.mass);
  EXPECT_EQ(heavy.p_BoBcm, body.p_BoBcm);
  EXPECT_THAT(heavy.I_BBcm_B, is_near((3.0 * body.I_BBcm_B).eval(), 1e-12));
}

TEST(MassProperties, PhysicalMeansTheInertiaOfSomeMass) {
  MassProperties body = mass_properties(BoxShape{{0.1, 0.2, 0.3}}, kDensity);
  EXPECT_TRUE(body.is_physical());
  const auto broken = [&](auto change) {
    MassProperties copy = body;
    change(copy);
    return !copy.is_physical();
  };
  EXPECT_TRUE(broken([](MassProperties& m) { m.mass = 0.0; }));
  EXPECT_TRUE(broken([](MassProperties& m) { m.mass = std::nan(""); }));
  EXPECT_TRUE(broken([](MassProperties& m) { m.p_BoBcm.x() = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(broken([](MassProperties& m) { m.I_BBcm_B(0, 1) += 0.1 * m.I_BBcm_B(0, 0); }));
  EXPECT_TRUE(broken([](MassProperties& m) { m.I_BBcm_B(0, 0) *= -1.0; }));
  // Two moments always sum to at least the third.
  EXPECT_TRUE(broken([](MassProperties& m) { m.I_BBcm_B = Vector3d(1.0, 1.0, 2.1).asDiagonal(); }));
  body.I_BBcm_B = Vector3d(1.0, 1.0, 2.0).asDiagonal();  // A flat plate.
  EXPECT_TRUE(body.is_physical());
}

}  // namespace
}  // namespace prescene::geometry
