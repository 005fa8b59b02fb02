// SPDX-License-Identifier: Apache-2.0
// Ray queries on every instruction set of the machine against brute force over all triangles, which they equal bit for
// bit, and the laws of rays: nothing slips out of a closed mesh, packets are singles.
#include "prescene/collision/ray_queries.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "prescene/core/random.h"
#include "tests/support/allocations.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/generators.h"
#include "tests/support/target_test.h"

namespace prescene::collision::ray_queries_laws_test {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TriangleTree tree_of(std::shared_ptr<const Mesh> mesh) {
  core::ThreadPool pool(1);
  return TriangleTree::build(std::move(mesh), {}, pool);
}

TriangleTree tree_of(const geometry::TriangleMesh& mesh) { return tree_of(tests::collision_mesh(mesh, "mesh")); }

std::optional<RayHit> brute_force(const Mesh& mesh, const Ray& ray) {
  const std::optional<ShearedRay> sheared = shear(ray);
  if (!sheared) return std::nullopt;
  std::optional<RayTriangleHit> nearest;
  std::uint32_t triangle = 0;
  for (std::uint32_t i = 0; i < mesh.triangle_count(); ++i) {
    const auto hit = meet(*sheared, mesh.corners(i));
    if (!hit || (nearest && nearest->s <= hit->s)) continue;
    nearest = hit;
    triangle = i;
  }
  if (!nearest) return std::nullopt;
  const double t = std::clamp(nearest->s / sheared->metres, ray.t_min, ray.t_max);
  return RayHit{t, nearest->weights, triangle, nearest->front};
}

Vector3d unit_vector(core::RandomStream& random) {
  Vector3d v;
  do {
    v = {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
  } while (v.norm() > 1.0 || v.norm() < 0.1);
  return v.normalized();
}

/// A ray that looks at the mesh from somewhere, often through corners and edges, along axes, or within a range.
Ray nasty_ray(const Mesh& mesh, core::RandomStream& random) {
  const auto any_corner = [&] {
    return mesh.vertices()[random.uniform_below(mesh.vertices().size())].cast<double>().eval();
  };
  const auto size = static_cast<double>(mesh.size());
  const bool at_corner = random.uniform() < 0.5;
  Vector3d target = any_corner();
  if (!at_corner) target = 0.5 * (target + any_corner());
  Ray ray;
  const double far = std::pow(10.0, random.uniform(-2.0, 4.0));
  ray.origin = random.uniform() < 0.3 ? any_corner() : Vector3d(target + far * size * unit_vector(random));
  ray.direction = target - ray.origin;
  if (random.uniform() < 0.3) {
    const auto axis = static_cast<int>(random.uniform_below(3));
    ray.direction = (random.uniform() < 0.5 ? 1.0 : -1.0) * Vector3d::Unit(axis);
    ray.origin = target - far * size * ray.direction;
  }
  if (ray.direction.norm() == 0.0) ray.direction = unit_vector(random);
  ray.direction *= std::pow(10.0, random.uniform(-6.0, 6.0));
  if (random.uniform() < 0.2) ray.t_min = -kInfinity;
  if (random.uniform() < 0.3)
    ray.t_max = random.uniform(0.0, 2.0) * (target - ray.origin).norm() / ray.direction.norm();
  return ray;
}

std::vector<std::shared_ptr<const Mesh>> test_meshes() {
  geometry::TriangleMesh far_away = geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}});
  for (Vector3d& p : far_away.vertices) p += Vector3d(100.0, -50.0, 20.0);
  geometry::TriangleMesh tiny = geometry::make_mesh(geometry::Sphere{1.0}, 24);
  for (Vector3d& p : tiny.vertices) p *= 1e-30;
  geometry::TriangleMesh huge = geometry::make_mesh(geometry::Cylinder{1.0, 2.0}, 24);
  for (Vector3d& p : huge.vertices) p *= 1e8;
  geometry::TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, 0.0}};
  flat.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {0, 4, 2}, {4, 4, 4}};
  return {tests::collision_mesh(geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}}), "box"),
          tests::collision_mesh(tests::make_bumpy_sphere(0.1, 2000), "bumpy"),
          tests::collision_mesh(tests::make_knot(0.1, 1000), "knot"),
          tests::collision_mesh(tests::make_wavy_sheet(0.3, 500), "sheet"),
          tests::collision_mesh(far_away, "far"),
          tests::collision_mesh(tiny, "tiny"),
          tests::collision_mesh(huge, "huge"),
          tests::collision_mesh(flat, "flat")};
}

class RayQueries : public TargetTest {
 protected:
  QueryScratch scratch_;
};

TEST_P(RayQueries, AreBruteForceBitForBitAndPacketsAreSingles) {
  int hits = 0;
  int rays = 0;
  for (const auto& mesh : test_meshes()) {
    const TriangleTree tree = tree_of(mesh);
    core::RandomStream random(7, {});
    std::vector<Ray> some(403);
    for (Ray& ray : some) ray = nasty_ray(*mesh, random);
    std::vector<std::optional<RayHit>> together(some.size());
    nearest_hits(tree, some, together, scratch_);
    const auto any_together = std::make_unique<bool[]>(some.size());
    any_hits(tree, some, {any_together.get(), some.size()}, scratch_);
    for (std::size_t i = 0; i < some.size(); ++i) {
      const std::optional<RayHit> expected = brute_force(*mesh, some[i]);
      ASSERT_EQ(nearest_hit(tree, some[i], scratch_), expected) << mesh->name() << " ray " << i;
      ASSERT_EQ(together[i], expected) << mesh->name() << " ray " << i;
      ASSERT_EQ(any_hit(tree, some[i], scratch_), expected.has_value());
      ASSERT_EQ(any_together[i], expected.has_value());
      ++rays;
      hits += expected.has_value() ? 1 : 0;
    }
  }
  std::printf("%d rays compared with brute force, %d of them hit\n", rays, hits);
  EXPECT_GT(hits, rays / 4);
  EXPECT_LT(hits, rays);
}

TEST_P(RayQueries, CoherentPacketsAreSingles) {
  const TriangleTree tree = tree_of(tests::make_knot(0.1, 20000));
  std::vector<Ray> rays;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) rays.push_back({{0.3, 0.2, 0.1}, {-0.3 + 0.005 * x, -0.2 + 0.005 * y, -0.1}});
  }
  std::vector<std::optional<RayHit>> together(rays.size());
  nearest_hits(tree, rays, together, scratch_);
  for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(together[i], nearest_hit(tree, rays[i], scratch_));
}

TEST_P(RayQueries, NoRaySlipsOutOfAClosedMesh) {
  const std::array<geometry::TriangleMesh, 4> meshes = {
      geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}}), geometry::make_mesh(geometry::Sphere{0.3}, 48),
      geometry::make_mesh(geometry::Cylinder{0.05, 0.2}, 48), tests::make_bumpy_sphere(0.2, 6000)};
  int rays = 0;
  for (const geometry::TriangleMesh& from : meshes) {
    const TriangleTree tree = tree_of(from);
    const Mesh& mesh = tree.mesh();
    core::RandomStream random(11, {});
    const auto expect_hit = [&](const Vector3d& origin, const Vector3d& direction) {
      ++rays;
      return nearest_hit(tree, {origin, direction}, scratch_).has_value() &&
             any_hit(tree, {origin, direction}, scratch_);
    };
    for (int i = 0; i < 4; ++i) {
      const Vector3d origin = i == 0 ? Vector3d::Zero() : Vector3d(0.03 * unit_vector(random));
      for (const Vector3f& p : mesh.vertices()) ASSERT_TRUE(expect_hit(origin, p.cast<double>() - origin));
      for (std::uint32_t triangle = 0; triangle < mesh.triangle_count(); ++triangle) {
        const auto corners = mesh.corners(triangle);
        const double share = i == 0 ? 0.5 : random.uniform();
        const Vector3d p = (1.0 - share) * corners[0].cast<double>() + share * corners[1].cast<double>();
        ASSERT_TRUE(expect_hit(origin, p - origin));
      }
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_TRUE(expect_hit(origin, Vector3d::Unit(axis)));
        ASSERT_TRUE(expect_hit(origin, -Vector3d::Unit(axis)));
      }
    }
  }
  std::printf("%d rays aimed at corners and edges from inside\n", rays);
}

TEST_P(RayQueries, FindCornersFromOutside) {
  // The origin and the corner are exact, so is the direction: the ray passes exactly through the corner.
  const TriangleTree tree = tree_of(geometry::make_mesh(geometry::BoxShape{{0.5, 0.25, 0.125}}));
  for (const Vector3f& p : tree.mesh().vertices()) {
    const Vector3d corner = p.cast<double>();
    for (const double far : {1.0, 64.0, 4096.0}) {
      const auto hit = nearest_hit(tree, {(1.0 + far) * corner, -corner}, scratch_);
      ASSERT_TRUE(hit.has_value());
      EXPECT_EQ(hit->t, far);
    }
  }
}

TEST_P(RayQueries, TellSidesWeightsAndRanges) {
  const geometry::BoxShape box{{1.0, 1.0, 1.0}};
  const TriangleTree tree = tree_of(geometry::make_mesh(box));
  const auto extent = static_cast<double>(tree.mesh().vertices()[0].cwiseAbs().maxCoeff());
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      Ray ray;
      ray.direction = 2.0 * sign * Vector3d::Unit(axis);
      ray.origin = -10.0 * extent * sign * Vector3d::Unit(axis) + Vector3d(0.01, 0.02, 0.03);
      const auto in = nearest_hit(tree, ray, scratch_);
      ASSERT_TRUE(in.has_value());
      EXPECT_TRUE(in->front);
      const auto corners = tree.mesh().corners(in->triangle);
      Vector3d p = Vector3d::Zero();
      for (std::size_t i = 0; i < 3; ++i) p += in->weights[i] * corners[i].cast<double>();
      EXPECT_LT((p - (ray.origin + in->t * ray.direction)).norm(), 1e-14);
      // The hit at either end of the range counts; nothing before or behind it does.
      ray.t_max = in->t;
      EXPECT_TRUE(any_hit(tree, ray, scratch_));
      ray.t_max = in->t - 1e-12;
      EXPECT_FALSE(any_hit(tree, ray, scratch_));
      ray.t_max = kInfinity;
      ray.t_min = in->t;
      EXPECT_EQ(nearest_hit(tree, ray, scratch_), in);
      ray.t_min = in->t + 1e-12;
      const auto out = nearest_hit(tree, ray, scratch_);
      ASSERT_TRUE(out.has_value());
      EXPECT_FALSE(out->front);
      EXPECT_NEAR(out->t - in->t, extent, 1e-14);
    }
  }
}

TEST_P(RayQueries, HitTheTriangleTheyStartOn) {
  core::RandomStream random(3, {});
  const TriangleTree tree = tree_of(geometry::make_mesh(geometry::BoxShape{{0.5, 0.25, 0.125}}));
  for (int i = 0; i < 300; ++i) {
    const double z = random.uniform(-0.0625, 0.0625), y = random.uniform(-0.125, 0.125),
                 x = random.uniform(-0.25, 0.25);
    Vector3d origin(x, y, z);
    const auto axis = static_cast<int>(random.uniform_below(3));
    origin[axis] = static_cast<double>(tree.mesh().vertices()[0][axis]);
    const auto hit = nearest_hit(tree, {origin, unit_vector(random)}, scratch_);
    ASSERT_TRUE(hit.has_value());
    EXPECT_LT(hit->t, 1e-15);
  }
}

TEST_P(RayQueries, DoNotMeetTrianglesWithoutArea) {
  geometry::TriangleMesh line;
  line.vertices = {{0, 0, 0}, {1, 0, 0}, {0.5, 0, 0}};
  line.triangles = {{0, 1, 2}, {0, 0, 1}, {2, 2, 2}};
  const TriangleTree tree = tree_of(line);
  EXPECT_FALSE(any_hit(tree, {{0.25, 0, 1}, {0, 0, -1}}, scratch_));
  EXPECT_FALSE(any_hit(tree, {{0.5, 0, 0}, {0, 0, -1}}, scratch_));
  EXPECT_FALSE(any_hit(tree, {{-1, 0, 0}, {1, 0, 0}}, scratch_));
}

TEST_P(RayQueries, AnswerNothingToRaysThatAreNotInOrder) {
  const TriangleTree tree = tree_of(geometry::make_mesh(geometry::BoxShape{{1.0, 1.0, 1.0}}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Ray good{{0, 0, 0}, {0, 0, 1}};
  ASSERT_TRUE(any_hit(tree, good, scratch_));
  std::vector<Ray> bad(12, good);
  bad[0].direction = {0, 0, 0};
  bad[1].direction = {nan, 0, 1};
  bad[2].direction = {0, kInfinity, 1};
  bad[3].origin = {0, nan, 0};
  bad[4].origin = {-kInfinity, 0, 0};
  bad[5].t_min = nan;
  bad[6].t_max = nan;
  bad[7].t_max = -1.0;
  bad[8].direction = {0, 0, 1e-200};
  bad[9].origin = {0, 0, -1e10};
  bad[10].direction = {1e200, 0, 1};
  bad[11].t_min = kInfinity;
  std::vector<std::optional<RayHit>> together(bad.size());
  nearest_hits(tree, bad, together, scratch_);
  for (std::size_t i = 0; i < bad.size(); ++i) {
    EXPECT_FALSE(any_hit(tree, bad[i], scratch_)) << i;
    EXPECT_FALSE(nearest_hit(tree, bad[i], scratch_).has_value()) << i;
    EXPECT_FALSE(together[i].has_value()) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(AllTargets, RayQueries, testing::ValuesIn(all_targets()), target_name);

TEST(RayQueriesInFrames, MoveWithTheBody) {
  EXPECT_TRUE(tests::check_law([] {
    const TriangleTree tree = tree_of(*tests::closed_meshes());
    const geometry::Pose pose = *tests::poses();
    const auto X_WB = to_transform(pose);
    RC_ASSERT(X_WB.ok());
    // Of float entries, so that going there and back is only as good as they are.
    const Ray ray_B{*tests::vectors(1.0), *tests::directions()};
    const Ray back = in_frame(inverse(*X_WB), in_frame(*X_WB, ray_B));
    RC_ASSERT((back.origin - ray_B.origin).norm() < 1e-5);
    RC_ASSERT((back.direction - ray_B.direction).norm() < 1e-6);
  }));
}

TEST(RayQueriesInFrames, CountTheirTestsAndDoNotAllocateOnceWarm) {
  const TriangleTree tree = tree_of(tests::make_bumpy_sphere(0.1, 20000));
  std::vector<Ray> rays;
  core::RandomStream random(5, {});
  for (int i = 0; i < 64; ++i) rays.push_back({unit_vector(random), 0.1 * unit_vector(random)});
  for (Ray& ray : rays) ray.direction -= ray.origin;
  std::vector<std::optional<RayHit>> hits(rays.size());
  QueryScratch scratch;
  QueryCounts counts;
  for (const bool warm : {false, true}) {
    const std::uint64_t before = tests::can_count_allocations() ? tests::allocation_count() : 0;
    for (const Ray& ray : rays) nearest_hit(tree, ray, scratch, &counts);
    nearest_hits(tree, rays, hits, scratch, &counts);
    EXPECT_TRUE(!warm || !tests::can_count_allocations() || tests::allocation_count() == before);
  }
  EXPECT_GT(counts.node_pairs, 0U);
  EXPECT_GT(counts.volume_tests, counts.node_pairs);
  EXPECT_GT(counts.triangle_tests, 0U);
}

}  // namespace
}  // namespace prescene::collision::ray_queries_laws_test
