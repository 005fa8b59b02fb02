// SPDX-License-Identifier: Apache-2.0
// Nearest points and winding numbers against all triangles one by one, for each instruction set.
#include "prescene/collision/point_queries.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/triangle_distance.h"
#include "tests/support/allocations.h"
#include "tests/support/target_test.h"

namespace prescene::collision::point_queries_test {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

core::ThreadPool& pool() {
  static core::ThreadPool threads(2);
  return threads;
}

TriangleTree tree_of(const geometry::TriangleMesh& mesh) {
  return TriangleTree::build(*Mesh::make(mesh, "test"), {}, pool());
}

Vector3d random_vector(core::RandomStream& stream, double reach) {
  return {stream.uniform(-reach, reach), stream.uniform(-reach, reach), stream.uniform(-reach, reach)};
}

/// Triangles of all sizes and shapes, some of them needles, segments and points.
geometry::TriangleMesh soup(int count) {
  core::RandomStream stream(41, core::Purpose::kTest);
  geometry::TriangleMesh mesh;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) {
    const double size = std::pow(10.0, stream.uniform(-5.0, -0.5));
    const Vector3d a = random_vector(stream, 0.5);
    const Vector3d b = a + random_vector(stream, size);
    Vector3d c = a + random_vector(stream, size);
    if (i % 7 == 1) c = 0.5 * (a + b);
    if (i % 11 == 1) c = b;
    for (const Vector3d& corner : {a, i % 77 == 1 ? a : b, i % 77 == 1 ? a : c}) mesh.vertices.push_back(corner);
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

geometry::TriangleMesh nested() {
  geometry::TriangleMesh mesh = geometry::make_mesh(geometry::Sphere{0.3}, 48);
  for (const auto& [other, shift] : {std::pair(geometry::make_mesh(geometry::BoxShape{{0.2, 0.2, 0.2}}), 0.0),
                                     std::pair(geometry::make_mesh(geometry::Cylinder{0.1, 0.5}), 0.35)}) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vector3d& v : other.vertices) mesh.vertices.push_back(v + Vector3d(shift, 0, 0));
    for (const auto& t : other.triangles) mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return mesh;
}

double squared_distance(const Mesh& mesh, std::uint32_t triangle, const Vector3d& p) {
  const auto corners = mesh.corners(triangle);
  return geometry::squared_distance_to_triangle(p, corners[0].cast<double>(), corners[1].cast<double>(),
                                                corners[2].cast<double>());
}

double least_distance(const Mesh& mesh, const Vector3d& p) {
  double least = kInfinity;
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) least = std::min(least, squared_distance(mesh, i, p));
  return std::sqrt(least);
}

class PointQueries : public TargetTest {};
INSTANTIATE_TEST_SUITE_P(AllTargets, PointQueries, testing::ValuesIn(all_targets()), target_name);

TEST_P(PointQueries, NearestPointIsThatOfAllTriangles) {
  core::RandomStream stream(42, core::Purpose::kTest);
  for (const geometry::TriangleMesh& mesh : {soup(1500), nested(), soup(1)}) {
    const TriangleTree tree = tree_of(mesh);
    for (int i = 0; i < 1000; ++i) {
      Vector3d p = random_vector(stream, i % 3 == 0 ? 3.0 : 0.5);
      if (i % 50 == 1) p *= 1e6;
      if (i % 10 == 2) p = tree.mesh().vertices()[stream.uniform_below(tree.mesh().vertices().size())].cast<double>();
      const double expected = least_distance(tree.mesh(), p);
      const double rounding = 1e-15 * (1.0 + p.norm());
      const auto nearest = nearest_point(tree, p);
      ASSERT_TRUE(nearest);
      ASSERT_NEAR(nearest->distance, expected, 1e-8 * expected + rounding);
      ASSERT_NEAR((nearest->point - p).norm(), nearest->distance, 1e-9 * expected + rounding);
      ASSERT_NEAR(std::sqrt(squared_distance(tree.mesh(), nearest->triangle, p)), nearest->distance,
                  1e-8 * expected + rounding);
      const double off = 1e-7 * expected + 10.0 * rounding;
      ASSERT_TRUE(nearest_point(tree, p, expected + off) && is_within(tree, p, expected + off));
      ASSERT_FALSE(nearest_point(tree, p, expected - off) || is_within(tree, p, expected - off));
    }
  }
}

TEST_P(PointQueries, EveryInstructionSetGivesTheSameBits) {
  const TriangleTree tree = tree_of(nested());
  core::RandomStream stream(44, core::Purpose::kTest);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p = random_vector(stream, 0.6);
    use_target(GetParam());
    const auto nearest = nearest_point(tree, p);
    use_target(0);
    const auto other = nearest_point(tree, p);
    ASSERT_TRUE(nearest && other);
    ASSERT_EQ(nearest->distance, other->distance);
    ASSERT_EQ(nearest->point, other->point);
    ASSERT_EQ(nearest->triangle, other->triangle);
  }
}

TEST_P(PointQueries, WindingNumbersCountSolids) {
  core::RandomStream stream(43, core::Purpose::kTest);
  const TriangleTree tree = tree_of(nested());
  // The sphere and the cylinder have flat faces.
  const double shrunk = std::cos(std::numbers::pi / 48.0);
  int compared = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p = random_vector(stream, 0.5);
    const double beside = std::hypot(p.x() - 0.35, p.y());
    if (std::abs(p.norm() - 0.3) < 0.3 * (1.0 - shrunk * shrunk) || std::abs(beside - 0.1) < 0.1 * (1.0 - shrunk))
      continue;
    const int expected = (p.norm() < 0.3 ? 1 : 0) + (p.cwiseAbs().maxCoeff() < 0.1 ? 1 : 0) +
                         (beside < 0.1 && std::abs(p.z()) < 0.25 ? 1 : 0);
    ++compared;
    ASSERT_EQ(winding_number(tree, p), expected);
  }
  EXPECT_GT(compared, 18000);
  // Straight below vertices and edges, too.
  for (const Vector3f& v : tree.mesh().vertices()) {
    const Vector3d p = v.cast<double>();
    EXPECT_EQ(winding_number(tree, {p.x(), p.y(), -1.0}), 0);
    EXPECT_EQ(winding_number(tree, {p.x(), p.y(), 1.0}), 0);
  }
  EXPECT_EQ(winding_number(tree, {0.0, 0.0, 0.0}), 2);
}

TEST_P(PointQueries, PointsThatAreNotFiniteAreNearNothing) {
  const TriangleTree tree = tree_of(nested());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double x : {nan, kInfinity, -kInfinity}) {
    EXPECT_FALSE(nearest_point(tree, {x, 0.0, 0.0}));
    EXPECT_FALSE(is_within(tree, {0.0, x, 0.0}, 1.0));
    EXPECT_EQ(winding_number(tree, {0.0, 0.0, x}), 0);
  }
  EXPECT_FALSE(nearest_point(tree, {0, 0, 0}, 0.0));
  EXPECT_FALSE(nearest_point(tree, {0, 0, 0}, -1.0));
  EXPECT_FALSE(nearest_point(tree, {0, 0, 0}, nan));
}

TEST_P(PointQueries, DoNotAllocate) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations are not counted in this build";
  const TriangleTree tree = tree_of(soup(1000));
  const auto before = tests::allocation_count();
  (void)nearest_point(tree, {0.1, 0.2, 0.3});
  (void)is_within(tree, {0.1, 0.2, 0.3}, 0.1);
  (void)winding_number(tree, {0.1, 0.2, 0.3});
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace prescene::collision::point_queries_test
