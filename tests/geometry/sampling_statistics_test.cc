// SPDX-License-Identifier: Apache-2.0
// Each figure is compared with a bound that a perfect sampler exceeds once in a million draws of the seed.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/matchers.h"

namespace prescene::geometry {
namespace {

constexpr int kDraws = 40000;
const double kNormalBound = core::inverse_normal_cdf(1.0 - 0.5e-6);
// Upper millionth of chi squared with 63 degrees of freedom [Wilson & Hilferty 1931].
constexpr double kChiSquaredBound63 = 131.8;

double chi_squared(const std::vector<double>& counts, double expected) {
  double sum = 0.0;
  for (const double count : counts) sum += (count - expected) * (count - expected) / expected;
  return sum;
}

TEST(UniformRotation, AngleHasTheDensityOfTheGroup) {
  // The share of rotations of less than a is (a - sin a) / pi; 64 bins of equal share.
  core::RandomStream stream(1, core::Purpose::kTest);
  std::vector<double> counts(64, 0.0);
  for (int i = 0; i < kDraws; ++i) {
    const Quaterniond q = uniform_rotation(stream);
    ASSERT_NEAR(q.norm(), 1.0, 1e-14);
    const double angle = angle_between(Quaterniond::Identity(), q);
    ++counts[std::min<std::size_t>(63, static_cast<std::size_t>(64.0 * (angle - std::sin(angle)) / M_PI))];
  }
  EXPECT_LT(chi_squared(counts, kDraws / 64.0), kChiSquaredBound63);
}

TEST(UniformRotation, TurnsAVectorToAUniformDirection) {
  core::RandomStream stream(2, core::Purpose::kTest);
  const Vector3d v = Vector3d(0.3, -0.5, 0.8).normalized();
  std::vector<double> counts(64, 0.0);
  for (int i = 0; i < kDraws; ++i) {
    // Equal areas of the sphere: 8 slices of z by 8 of the azimuth [Archimedes].
    const Vector3d d = uniform_rotation(stream) * v;
    const auto slice = static_cast<std::size_t>(std::min(7.0, 4.0 * (d.z() + 1.0)));
    const auto sector = static_cast<std::size_t>(std::min(7.0, 4.0 * (std::atan2(d.y(), d.x()) / M_PI + 1.0)));
    ++counts[8 * slice + sector];
  }
  EXPECT_LT(chi_squared(counts, kDraws / 64.0), kChiSquaredBound63);
}

TEST(UniformDirection, FillsTheSphereEvenly) {
  core::RandomStream stream(3, core::Purpose::kTest);
  std::vector<double> counts(64, 0.0);
  for (int i = 0; i < kDraws; ++i) {
    const Vector3d d = uniform_direction(stream);
    ASSERT_NEAR(d.norm(), 1.0, 1e-14);
    // Slices of x, so that they are not those of the sampler.
    const auto slice = static_cast<std::size_t>(std::min(7.0, 4.0 * (d.x() + 1.0)));
    const auto sector = static_cast<std::size_t>(std::min(7.0, 4.0 * (std::atan2(d.z(), d.y()) / M_PI + 1.0)));
    ++counts[8 * slice + sector];
  }
  EXPECT_LT(chi_squared(counts, kDraws / 64.0), kChiSquaredBound63);
}

TEST(NormalVector, HasUnitCovariance) {
  core::RandomStream stream(4, core::Purpose::kTest);
  Matrix3d sum = Matrix3d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Vector3d v = normal_vector(stream);
    sum += v * v.transpose() / kDraws;
  }
  // The standard deviation of a mean square is sqrt(2 / n), of a mean product sqrt(1 / n).
  EXPECT_THAT(sum, tests::is_near(Matrix3d::Identity(), kNormalBound * std::sqrt(2.0 / kDraws)));
}

TEST(SampleSurface, EachTriangleGetsPointsLikeItsArea) {
  const TriangleMesh box = make_mesh(BoxShape{{0.1, 0.2, 0.7}});
  const auto points = sample_surface(box, kDraws, 5);
  ASSERT_EQ(points.size(), static_cast<std::size_t>(kDraws));
  // Share of the two faces across z: 0.02 of 0.02 + 0.07 + 0.14.
  double across_z = 0.0;
  Vector3d mean = Vector3d::Zero();
  for (const SurfacePoint& p : points) {
    const Vector3d scaled = p.position.cwiseQuotient(Vector3d(0.05, 0.1, 0.35)).cwiseAbs();
    EXPECT_NEAR(scaled.maxCoeff(), 1.0, 1e-12);
    EXPECT_NEAR(std::abs(p.normal.dot(p.position)), p.normal.cwiseAbs().dot(Vector3d(0.05, 0.1, 0.35)), 1e-12);
    EXPECT_GT(p.normal.dot(p.position), 0.0);
    across_z += std::abs(p.normal.z()) > 0.5;
    mean += p.position / kDraws;
  }
  const double share = 0.02 / 0.23;
  EXPECT_NEAR(across_z / kDraws, share, kNormalBound * std::sqrt(share * (1.0 - share) / kDraws));
  // Per coordinate the standard deviation of a point is below half the box's edge.
  EXPECT_THAT(mean, tests::is_near(Vector3d::Zero(), kNormalBound * 0.35 / std::sqrt(kDraws)));
}

TEST(SampleSurface, PointsWithinATriangleAreUniform) {
  TriangleMesh mesh;
  mesh.vertices = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};
  mesh.triangles = {{0, 1, 2}};
  std::vector<double> counts(64, 0.0);
  for (const SurfacePoint& p : sample_surface(mesh, kDraws, 6)) {
    // (x / (1 - y), (1 - y)^2) is uniform in the unit square for uniform points of this triangle.
    const double a = p.position.x() / (1.0 - p.position.y());
    const double b = std::pow(1.0 - p.position.y(), 2);
    const auto i = static_cast<std::size_t>(std::min(7.0, 8.0 * a));
    const auto j = static_cast<std::size_t>(std::min(7.0, 8.0 * b));
    ++counts[8 * i + j];
  }
  EXPECT_LT(chi_squared(counts, kDraws / 64.0), kChiSquaredBound63);
}

TEST(SampleSurface, DependsOnTheSeedOnly) {
  const TriangleMesh box = make_mesh(BoxShape{{0.1, 0.2, 0.7}});
  const auto first = sample_surface(box, 10, 5);
  const auto more = sample_surface(box, 20, 5);
  const auto other = sample_surface(box, 10, 6);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(first[i].position, more[i].position);
    EXPECT_NE(first[i].position, other[i].position);
  }
}

}  // namespace
}  // namespace prescene::geometry
