// SPDX-License-Identifier: Apache-2.0
// Distances of meshes against brute force in double precision, for each instruction set, and the laws that any distance
// obeys.
#include <gmock/gmock.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "prescene/collision/distance_queries.h"
#include "prescene/collision/triangle_pair_distance.h"
#include "tests/support/allocations.h"
#include "tests/support/generators.h"
#include "tests/support/target_test.h"

namespace prescene::collision::distance_queries_laws_test {
namespace {

// Of the nearest pair in single precision: distance_queries.h.
constexpr double kRounding = 0x1p-19;

std::shared_ptr<const Mesh> to_mesh(const geometry::TriangleMesh& mesh) {
  auto made = Mesh::make(mesh, "mesh");
  RC_ASSERT(made.ok());
  return *made;
}

TriangleTree tree_of(std::shared_ptr<const Mesh> mesh) {
  core::ThreadPool pool(1);
  return TriangleTree::build(std::move(mesh), {}, pool);
}

TriangleTree tree_of(const geometry::TriangleMesh& mesh) { return tree_of(to_mesh(mesh)); }

Transform transform_of(const geometry::Pose& X_AB) {
  const auto made = to_transform(X_AB);
  RC_ASSERT(made.ok());
  return *made;
}

Triangle placed(const Transform& X_AB, const std::array<Vector3f, 3>& triangle) {
  return {X_AB * triangle[0], X_AB * triangle[1], X_AB * triangle[2]};
}

double distance_of_pair(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB, const TrianglePair& pair) {
  return triangle_pair_distance(a.mesh().corners(pair.a), placed(X_AB, b.mesh().corners(pair.b))).distance;
}

double brute_force(const Mesh& a, const Mesh& b, const Transform& X_AB) {
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t k = 0; k < b.triangle_count(); ++k) {
    const Triangle triangle_b = placed(X_AB, b.corners(k));
    for (std::uint32_t i = 0; i < a.triangle_count(); ++i)
      least = std::min(least, triangle_pair_distance(a.corners(i), triangle_b).distance);
  }
  return least;
}

/// Of coordinates in A's frame, m.
double extent(const TriangleTree& a, const TriangleTree& b, const Transform& X_AB) {
  double sum = static_cast<double>(a.radius()) + static_cast<double>(b.radius());
  for (const float t : X_AB.translation) sum += std::abs(static_cast<double>(t));
  return sum;
}

/// A pose of B that brings a random vertex of each body together, up to `apart`.
geometry::Pose touching_pose(const Mesh& a, const Mesh& b, double apart) {
  geometry::Pose X_AB;
  X_AB.rotation = *tests::rotations();
  const auto pick = [](const Mesh& mesh) {
    return mesh.vertices()[*rc::gen::inRange<std::size_t>(0, mesh.vertices().size())].cast<double>().eval();
  };
  const geometry::Vector3d meet = pick(a);
  X_AB.translation = meet - X_AB.rotation * pick(b) + *tests::vectors(apart);
  return X_AB;
}

/// Scattered, near and just touching.
Transform any_pose(const Mesh& a, const Mesh& b) {
  return transform_of(touching_pose(a, b, *rc::gen::element(1e-7, 1e-4, 0.01, 0.1, 3.0)));
}

double to_point(const Eigen::Vector3d& p, const Triangle& triangle) {
  const Vector3f single = p.cast<float>();
  return triangle_pair_distance({single, single, single}, triangle).distance;
}

class EachTarget : public testing::Test {
 public:
  static void check(const std::function<void()>& property) {
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      const UseTarget only(target);
      EXPECT_TRUE(tests::check_law(std::string("with ") + hwy::TargetName(target), property));
    }
  }
};

using DistanceQueries = EachTarget;

TEST_F(DistanceQueries, AreThoseOfBruteForce) {
  int configurations = 0;
  int intersecting = 0;
  check([&] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    QueryScratch scratch;
    for (int i = 0; i < 4; ++i) {
      const Transform X_AB = any_pose(a.mesh(), b.mesh());
      const double expected = brute_force(a.mesh(), b.mesh(), X_AB);
      const double rounding = kRounding * (2.0 * extent(a, b, X_AB));
      const std::optional<Distance> found = distance(a, b, X_AB, {}, scratch);
      RC_ASSERT(found.has_value());
      RC_ASSERT((found->distance == 0.0) == (expected == 0.0));
      RC_ASSERT((found->distance == 0.0) == collide(a, b, X_AB, scratch));
      RC_ASSERT(found->distance >= expected);
      RC_ASSERT(found->distance <= expected + rounding);
      // The triangles and points are those of the answer.
      RC_ASSERT(distance_of_pair(a, b, X_AB, found->triangles) == found->distance);
      RC_ASSERT(std::abs((found->p_B - found->p_A).norm() - found->distance) <= 1e-9);
      RC_ASSERT(to_point(found->p_A, a.mesh().corners(found->triangles.a)) <= rounding);
      RC_ASSERT(to_point(found->p_B, placed(X_AB, b.mesh().corners(found->triangles.b))) <= rounding);
      ++configurations;
      intersecting += expected == 0.0 ? 1 : 0;
    }
  });
  std::printf("%d distances compared with brute force, %d of them zero\n", configurations, intersecting);
  EXPECT_GT(intersecting, configurations / 10);
  EXPECT_LT(intersecting, configurations * 9 / 10);
}

TEST_F(DistanceQueries, KeepTheirTolerancesAndLimits) {
  check([] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    const Transform X_AB = any_pose(a.mesh(), b.mesh());
    const double expected = brute_force(a.mesh(), b.mesh(), X_AB);
    const double rounding = kRounding * (2.0 * extent(a, b, X_AB));
    QueryScratch scratch;
    DistanceOptions options;
    options.relative_tolerance = *rc::gen::element(0.0, 0.01, 0.5);
    options.absolute_tolerance = *rc::gen::element(-1.0, 0.0, 1e-3, 0.1);
    const std::optional<Distance> about = distance(a, b, X_AB, options, scratch);
    RC_ASSERT(about.has_value());
    RC_ASSERT((about->distance == 0.0) == (expected == 0.0));
    RC_ASSERT(about->distance >= expected);
    RC_ASSERT(about->distance <=
              expected + rounding + std::max(options.relative_tolerance * about->distance, options.absolute_tolerance));

    options.limit = expected * *rc::gen::element(0.0, 0.5, 0.999999, 1.0, 1.000001, 2.0);
    const std::optional<Distance> limited = distance(a, b, X_AB, options, scratch);
    RC_ASSERT(limited.has_value() == (expected <= options.limit));
    if (limited) RC_ASSERT(limited->distance <= options.limit && limited->distance >= expected);
    RC_ASSERT(within_distance(a, b, X_AB, options.limit, scratch) == (expected <= options.limit));
    RC_ASSERT(!within_distance(a, b, X_AB, -1e-3, scratch));
    RC_ASSERT(!within_distance(a, b, X_AB, std::numeric_limits<double>::quiet_NaN(), scratch));
    RC_ASSERT(within_distance(a, b, X_AB, std::numeric_limits<double>::infinity(), scratch));
  });
}

TEST_F(DistanceQueries, TakeOptionsThatAreNoNumbersAsNone) {
  check([] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    const Transform X_AB = any_pose(a.mesh(), b.mesh());
    QueryScratch scratch;
    const std::optional<Distance> plain = distance(a, b, X_AB, {}, scratch);
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    for (const DistanceOptions& options :
         {DistanceOptions{.relative_tolerance = kNone}, DistanceOptions{.absolute_tolerance = kNone},
          DistanceOptions{.limit = kNone}}) {
      const std::optional<Distance> same = distance(a, b, X_AB, options, scratch);
      RC_ASSERT(same.has_value());
      RC_ASSERT(same->distance == plain->distance);
    }
  });
}

TEST_F(DistanceQueries, AnswerTheSameFromAnySeed) {
  check([] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    const geometry::Pose pose = touching_pose(a.mesh(), b.mesh(), 0.05);
    geometry::Pose moved = pose;
    moved.translation += *tests::vectors(0.01);
    const Transform X_AB = transform_of(moved);
    QueryScratch scratch;
    const std::optional<Distance> unseeded = distance(a, b, X_AB, {}, scratch);
    RC_ASSERT(unseeded.has_value());
    const double rounding = kRounding * (2.0 * extent(a, b, X_AB));
    const std::optional<Distance> before = distance(a, b, transform_of(pose), {}, scratch);
    const TrianglePair random = {*rc::gen::inRange(0U, a.mesh().triangle_count() + 1),
                                 *rc::gen::inRange(0U, b.mesh().triangle_count() + 1)};
    for (const TrianglePair& seed : {before->triangles, random, unseeded->triangles}) {
      DistanceOptions options;
      options.seed = seed;
      const std::optional<Distance> seeded = distance(a, b, X_AB, options, scratch);
      RC_ASSERT(seeded.has_value());
      RC_ASSERT((seeded->distance == 0.0) == (unseeded->distance == 0.0));
      RC_ASSERT(std::abs(seeded->distance - unseeded->distance) <= rounding);
      RC_ASSERT(distance_of_pair(a, b, X_AB, seeded->triangles) == seeded->distance);
    }
  });
}

TEST_F(DistanceQueries, AreSymmetricAndRigid) {
  check([] {
    const geometry::TriangleMesh mesh_a = *tests::closed_meshes();
    const geometry::TriangleMesh mesh_b = *tests::closed_meshes();
    const TriangleTree a = tree_of(mesh_a);
    const TriangleTree b = tree_of(mesh_b);
    const Transform X_AB = any_pose(a.mesh(), b.mesh());
    QueryScratch scratch;
    const std::optional<Distance> one = distance(a, b, X_AB, {}, scratch);
    const std::optional<Distance> other = distance(b, a, inverse(X_AB), {}, scratch);
    RC_ASSERT(one.has_value() && other.has_value());
    // The question itself is rounded differently: a few units in the last place of the coordinates.
    const double rounding = 4.0 * kRounding * extent(a, b, X_AB);
    RC_ASSERT(std::abs(one->distance - other->distance) <= rounding);

    // Both meshes moved together.
    const geometry::Pose X_WM = *tests::poses(0.5);
    const auto moved = [&](geometry::TriangleMesh mesh) {
      for (geometry::Vector3d& p : mesh.vertices) p = X_WM.rotation * p + X_WM.translation;
      return tree_of(mesh);
    };
    const TriangleTree moved_a = moved(mesh_a);
    const TriangleTree moved_b = moved(mesh_b);
    Eigen::Matrix4d X = Eigen::Matrix4d::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col)
        X(row, col) = static_cast<double>(X_AB.rotation[static_cast<std::size_t>(3 * row + col)]);
      X(row, 3) = static_cast<double>(X_AB.translation[static_cast<std::size_t>(row)]);
    }
    const Eigen::Matrix4d X_W = X_WM.matrix();
    const auto X_moved = to_transform(Eigen::Matrix4d(X_W * X * X_W.inverse()));
    RC_ASSERT(X_moved.ok());
    const std::optional<Distance> together = distance(moved_a, moved_b, *X_moved, {}, scratch);
    RC_ASSERT(together.has_value());
    // Both meshes are rounded in the frame that they were moved into, their radii and translations there being larger.
    const double moved_rounding = 4.0 * kRounding * extent(moved_a, moved_b, *X_moved);
    RC_ASSERT(std::abs(one->distance - together->distance) <= rounding + moved_rounding);
  });
}

// Nearer than single precision can scale where they are.
TEST_F(DistanceQueries, OfPointsThatNearlyTouch) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const UseTarget only(target);
    for (const double x : {0.0, 56.0, 1e9}) {
      const TriangleTree point = tree_of({{{x, 0.0, 0.0}}, {{0, 0, 0}}});
      QueryScratch scratch;
      for (const float z : {1e-44F, 1e-40F, 1e-37F, 1e-30F, 1e-20F}) {
        Transform X_AB;
        X_AB.translation = {0.0F, 0.0F, z};
        const std::optional<Distance> found = distance(point, point, X_AB, {}, scratch);
        ASSERT_TRUE(found.has_value()) << x << " " << z;
        EXPECT_NEAR(found->distance, static_cast<double>(z), 1e-6 * static_cast<double>(z));
      }
    }
  }
}

TEST_F(DistanceQueries, ChangeNoMoreThanTheTranslation) {
  check([] {
    const TriangleTree a = tree_of(*tests::closed_meshes());
    const TriangleTree b = tree_of(*tests::closed_meshes());
    geometry::Pose pose = touching_pose(a.mesh(), b.mesh(), 0.1);
    const Transform first = transform_of(pose);
    const geometry::Vector3d step = *tests::vectors(*rc::gen::element(1e-5, 0.01, 0.5));
    pose.translation += step;
    const Transform second = transform_of(pose);
    QueryScratch scratch;
    const double before = distance(a, b, first, {}, scratch)->distance;
    const double after = distance(a, b, second, {}, scratch)->distance;
    RC_ASSERT(std::abs(after - before) <= step.norm() + 4.0 * kRounding * extent(a, b, second));
  });
}

TEST_F(DistanceQueries, KeepTheirPrecisionAtAnyScale) {
  check([] {
    const auto scale = *rc::gen::element(1e-30F, 1e-12F, 1e6F);
    const auto scaled = [scale](const geometry::TriangleMesh& mesh) {
      std::vector<Vector3f> vertices;
      std::vector<TriangleIndices> triangles;
      for (const geometry::Vector3d& p : mesh.vertices) vertices.push_back(p.cast<float>() * scale);
      for (const auto& t : mesh.triangles) triangles.push_back({t[0], t[1], t[2]});
      auto made = Mesh::make(std::move(vertices), std::move(triangles), "scaled");
      RC_ASSERT(made.ok());
      return tree_of(*made);
    };
    const TriangleTree a = scaled(*tests::closed_meshes());
    const TriangleTree b = scaled(*tests::closed_meshes());
    const Transform X_AB = transform_of(touching_pose(a.mesh(), b.mesh(), 0.1 * static_cast<double>(scale)));
    QueryScratch scratch;
    const std::optional<Distance> found = distance(a, b, X_AB, {}, scratch);
    RC_ASSERT(found.has_value());
    const double expected = brute_force(a.mesh(), b.mesh(), X_AB);
    RC_ASSERT((found->distance == 0.0) == (expected == 0.0));
    RC_ASSERT(found->distance >= expected);
    RC_ASSERT(found->distance <= expected + kRounding * 2.0 * extent(a, b, X_AB));
  });
}

TEST_F(DistanceQueries, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations cannot be counted in this build";
  const TriangleTree a = tree_of(geometry::make_mesh(geometry::Sphere{0.1}, 64));
  const TriangleTree b = tree_of(geometry::make_mesh(geometry::Cylinder{0.05, 0.2}, 64));
  QueryScratch scratch;
  for (const bool warm : {false, true}) {
    const std::uint64_t before = tests::allocation_count();
    for (const float x : {0.12F, 0.16F, 0.2F, 0.5F}) {
      Transform X_AB;
      X_AB.translation = {x, 0.01F, 0.02F};
      EXPECT_TRUE(distance(a, b, X_AB, {}, scratch).has_value());
      EXPECT_TRUE(within_distance(a, b, X_AB, 1.0, scratch));
      EXPECT_FALSE(within_distance(a, b, X_AB, -1.0, scratch));
    }
    EXPECT_TRUE(!warm || tests::allocation_count() == before);
  }
}

}  // namespace
}  // namespace prescene::collision::distance_queries_laws_test
