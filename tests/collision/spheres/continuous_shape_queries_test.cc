// SPDX-License-Identifier: Apache-2.0
// Times of impact with static shapes against closed forms and motions looked at in small steps.
#include "prescene/collision/spheres/continuous_shape_queries.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "every_shape.h"
#include "prescene/collision/spheres/static_shape_queries.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "tests/support/allocations.h"

namespace prescene::collision::continuous_shape_queries_test {
namespace {

using core::RandomStream;
using Eigen::Vector3d;
using geometry::Pose;

constexpr double kFar = 1e9;

std::shared_ptr<const SphereTree> tree_of(const std::vector<PackedSphere>& spheres, int branching = 8) {
  const std::vector<SurfaceAnchor> anchors(spheres.size(), {Vector3f::Zero(), Vector3f::UnitZ()});
  const auto packing = SpherePacking::make(spheres, anchors, "test");
  EXPECT_TRUE(packing.ok());
  core::ThreadPool pool(1);
  const auto tree = SphereTree::make(*packing, {branching}, pool);
  EXPECT_TRUE(tree.ok());
  return *tree;
}

Vector3d random_vector(RandomStream& stream, double reach) {
  return {stream.uniform(-reach, reach), stream.uniform(-reach, reach), stream.uniform(-reach, reach)};
}

std::vector<PackedSphere> cloud(RandomStream& stream, int count) {
  std::vector<PackedSphere> spheres;
  for (int i = 0; i < count; ++i)
    spheres.push_back({random_vector(stream, 0.05).cast<float>(), static_cast<float>(stream.uniform(0.002, 0.01))});
  return spheres;
}

Pose random_pose(RandomStream& stream, double turn, double reach) {
  return {geometry::exp_rotation(random_vector(stream, turn)), random_vector(stream, reach)};
}

Vector3d in_shape(const Transform& X_AB, const Vector3f& c) {
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> R(X_AB.rotation.data());
  return R.cast<double>().transpose() *
         (c.cast<double>() - Eigen::Map<const Vector3f>(X_AB.translation.data()).cast<double>());
}

double least_gap(const std::vector<PackedSphere>& spheres, const StaticShape& shape,
                 const std::function<Vector3d(const Vector3f&)>& place) {
  double least = std::numeric_limits<double>::infinity();
  for (const PackedSphere& sphere : spheres)
    least = std::min(least, shape.nearest(place(sphere.centre), kFar)->distance - static_cast<double>(sphere.radius));
  return least;
}

TEST(ContinuousShapeQueries, SweptSpheresTouchWhenTheyShould) {
  RandomStream stream(21, core::Purpose::kTest);
  int hits = 0;
  int misses = 0;
  for (const std::unique_ptr<StaticShape>& shape : every_shape()) {
    for (int i = 0; i < 600; ++i) {
      // Some move along an axis, and some barely.
      Vector3d from = random_vector(stream, 0.3);
      Vector3d to = random_vector(stream, 0.3);
      if (i % 4 == 1) to = Vector3d(from.x(), from.y(), -from.z());
      if (i % 4 == 2) to = Vector3d(to.x(), from.y(), from.z());
      if (i % 8 == 3) to = from + 1e-6 * random_vector(stream, 1.0);
      const double radius = stream.uniform(0.001, 0.04);
      const auto gap = [&](double t) { return shape->nearest(from + t * (to - from), kFar)->distance - radius; };
      const auto time = shape->swept_sphere_contact(from, to, radius);
      if (gap(0.0) <= 0.0) {
        ASSERT_EQ(time, 0.0);
        continue;
      }
      const double until = time.value_or(1.0);
      for (int k = 0; k < 100; ++k) ASSERT_GT(gap(until * k / 100.0), 0.0);
      if (!time) {
        ++misses;
        ASSERT_GT(gap(1.0), 0.0);
      } else {
        ++hits;
        ASSERT_NEAR(gap(until), 0.0, 1e-12);
      }
    }
  }
  std::printf("%d hits, %d misses\n", hits, misses);
  EXPECT_GT(hits, 200);
  EXPECT_GT(misses, 200);
}

TEST(ContinuousShapeQueries, SweptSpheresKnownTimes) {
  const Vector3d x = Vector3d::UnitX();
  const Vector3d z = Vector3d::UnitZ();
  const auto floor = *HalfSpace::make(z, 0.0);
  EXPECT_EQ(floor.swept_sphere_contact(2.0 * z, -2.0 * z, 0.5), 0.375);
  EXPECT_FALSE(floor.swept_sphere_contact(2.0 * z, 2.0 * z + 9.0 * x, 0.5));                    // along it
  EXPECT_FALSE(floor.swept_sphere_contact(0.5 * z + 1e-12 * z, 0.5 * z + 1e-12 * z + x, 0.5));  // just above
  EXPECT_EQ(floor.swept_sphere_contact(0.5 * z, 2.0 * z, 0.5), 0.0);                            // touching, moving away
  const auto ball = *PrimitiveShape::make(geometry::Sphere{1.0});
  const Vector3d beside(-3.0, 1.5, 0.0);
  EXPECT_NEAR(ball.swept_sphere_contact(4.0 * x, -4.0 * x, 0.5).value_or(-1.0), 2.5 / 8.0, 1e-15);
  EXPECT_NEAR(ball.swept_sphere_contact(beside, beside + 6.0 * x, 0.5).value_or(-1.0), 0.5, 1e-6);  // grazing
  EXPECT_FALSE(ball.swept_sphere_contact(beside, beside + 6.0 * x, 0.5 - 1e-9));
  const HeightField::Grid block{2, 2, 1.0, 1.0, {0, 0, 0, 0}};
  const auto field = *HeightField::make(block, "block");
  // The sides, and the edge between two of them.
  EXPECT_EQ(field.swept_sphere_contact({2.0, 0.5, -3.0}, {0.0, 0.5, -3.0}, 0.25), 0.375);
  EXPECT_NEAR(field.swept_sphere_contact({2.0, 2.0, -3.0}, {0.0, 0.0, -3.0}, 0.5).value_or(-1.0),
              0.5 - 0.25 / std::numbers::sqrt2, 1e-15);
}

TEST(ContinuousShapeQueries, StraightMotionsMeetWhenTheFirstSphereDoes) {
  RandomStream stream(22, core::Purpose::kTest);
  SweepScratch scratch;
  int hits = 0;
  int misses = 0;
  for (const std::unique_ptr<StaticShape>& shape : every_shape()) {
    for (int i = 0; i < 60; ++i) {
      const auto spheres = cloud(stream, 60);
      const auto tree = tree_of(spheres, i % 2 == 0 ? 4 : 16);
      const Transform start = *to_transform(random_pose(stream, 1.0, 0.3));
      const Transform end = *to_transform(random_pose(stream, 1.0, 0.3));
      double expected = 2.0;
      for (const PackedSphere& sphere : spheres) {
        const auto time = shape->swept_sphere_contact(in_shape(start, sphere.centre), in_shape(end, sphere.centre),
                                                      static_cast<double>(sphere.radius));
        expected = std::min(expected, time.value_or(2.0));
      }
      const auto impact = time_of_impact(*tree, *shape, start, end, scratch);
      ASSERT_EQ(impact.has_value(), expected <= 1.0);
      ++(impact ? hits : misses);
      if (!impact) continue;
      EXPECT_NEAR(impact->time, expected, 1e-12);
      EXPECT_NEAR(impact->normal.norm(), 1.0, 1e-9);
      const PackedSphere& sphere = spheres[impact->sphere];
      EXPECT_NEAR((impact->point - sphere.centre.cast<double>()).norm(), static_cast<double>(sphere.radius), 1e-9);
    }
  }
  EXPECT_GT(hits, 60);
  EXPECT_GT(misses, 60);
}

TEST(ContinuousShapeQueries, ScrewsStopBeforeTheFirstContactAndAtIt) {
  RandomStream stream(23, core::Purpose::kTest);
  SweepScratch scratch;
  constexpr ImpactOptions kOptions = {.tolerance = 1e-6};
  int hits = 0;
  int misses = 0;
  for (const std::unique_ptr<StaticShape>& shape : every_shape()) {
    for (int i = 0; i < 25; ++i) {
      const auto spheres = cloud(stream, 25);
      const auto tree = tree_of(spheres, i % 2 == 0 ? 4 : 16);
      const Pose from = random_pose(stream, 1.0, 0.25);
      const Pose to = i % 5 == 0 ? Pose{geometry::exp_rotation({0, 0, 2}) * from.rotation, from.translation}
                                 : random_pose(stream, 1.0, 0.25);
      const auto motion = ScrewMotion::make(from, to);
      ASSERT_TRUE(motion.ok());
      const auto impact = time_of_impact(*tree, *shape, *motion, kOptions, scratch);
      ++(impact ? hits : misses);
      const double until = impact ? impact->time : 1.0;
      const auto gap_at = [&](double t) {
        const Pose X_BA = motion->pose(t).inverse();
        return least_gap(spheres, *shape, [&](const Vector3f& c) { return X_BA * c.cast<double>(); });
      };
      for (int k = 0; until > 0.0 && k < 100; ++k) ASSERT_GT(gap_at(until * k / 100.0), 0.0);
      if (!impact) {
        ASSERT_GT(gap_at(1.0), 0.0);
        continue;
      }
      EXPECT_LE(gap_at(until), kOptions.tolerance + 1e-12);
      if (until == 0.0) continue;
      // Where the sphere is nearest, the point lies on the shape.
      const auto at = shape->nearest(motion->pose(until).inverse() * impact->point, kFar);
      EXPECT_NEAR(at->distance, 0.0, kOptions.tolerance + 1e-9);
      // Just after it, something overlaps, unless the motion only grazes.
      double least = kFar;
      for (int k = 1; k <= 40; ++k) least = std::min(least, gap_at(std::min(1.0, until + 1e-4 * k)));
      EXPECT_LT(least, kOptions.tolerance);
    }
  }
  std::printf("%d screws meet, %d do not\n", hits, misses);
  EXPECT_GT(hits, 30);
  EXPECT_GT(misses, 30);
}

// A point that turns about an axis beside it is on the floor when its height's cosine says so.
TEST(ContinuousShapeQueries, ATurningSphereMeetsTheFloorAtItsAngle) {
  const auto floor = *HalfSpace::make(Vector3d::UnitZ(), 0.0);
  const auto tree = tree_of({{Vector3f(0.5F, 0.0F, 0.0F), 0.125F}}, 4);
  SweepScratch scratch;
  for (const double height : {0.2, 0.35, 0.5}) {
    // The body turns down by a quarter about an axis at that height.
    const Pose start = Pose::from_translation({0.0, 0.0, height});
    const Pose end = {geometry::exp_rotation({0.0, 0.5 * std::numbers::pi, 0.0}), start.translation};
    const auto motion = ScrewMotion::make(start.inverse(), end.inverse());
    ASSERT_TRUE(motion.ok());
    const double angle = std::asin((height - 0.125) / 0.5);
    const auto impact = time_of_impact(*tree, floor, *motion, {.tolerance = 1e-8}, scratch);
    ASSERT_TRUE(impact);
    EXPECT_NEAR(impact->time, angle / (0.5 * std::numbers::pi), 1e-7);
    EXPECT_LE(impact->time, angle / (0.5 * std::numbers::pi));
  }
}

// Just above a table, of any kind: spinning and sliding end, and touch nothing.
TEST(ContinuousShapeQueries, MotionsAlongASurfaceEnd) {
  std::vector<PackedSphere> plate;
  for (int x = 0; x < 20; ++x) {
    for (int y = 0; y < 20; ++y)
      plate.push_back({Vector3f(0.01F * static_cast<float>(x - 10), 0.01F * static_cast<float>(y - 10), 0), 0.005F});
  }
  const auto tree = tree_of(plate, 16);
  geometry::TriangleMesh top;
  top.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  top.triangles = {{0, 1, 2}, {0, 2, 3}};
  std::vector<std::unique_ptr<StaticShape>> tables;
  tables.push_back(std::make_unique<HalfSpace>(*HalfSpace::make(Vector3d::UnitZ(), 0.0)));
  tables.push_back(std::make_unique<TriangleSurface>(
      *TriangleSurface::make(*Mesh::make(top, "top"), SurfaceSide::kBoth, shape_pool())));
  tables.push_back(std::make_unique<HeightField>(*HeightField::make({3, 3, 1.0, 1.0, std::vector<float>(9)}, "field")));
  SweepScratch scratch;
  for (const std::unique_ptr<StaticShape>& table : tables) {
    const Pose slide = Pose::from_translation({0.2, 0.2, 0.0051});
    const Pose slid = {geometry::exp_rotation({0, 0, 3}), {0.5, 0.3, 0.0051}};
    EXPECT_FALSE(time_of_impact(*tree, *table, *to_transform(slide.inverse()),
                                *to_transform(Pose::from_translation({0.5, 0.3, 0.0051}).inverse()), scratch));
    const auto motion = ScrewMotion::make(slide.inverse(), slid.inverse());
    ASSERT_TRUE(motion.ok());
    EXPECT_FALSE(time_of_impact(*tree, *table, *motion, {.tolerance = 1e-5}, scratch));
    // It comes down while it turns.
    const Pose down = {slid.rotation, {0.5, 0.3, 0.0049}};
    const auto landing = ScrewMotion::make(slide.inverse(), down.inverse());
    ASSERT_TRUE(landing.ok());
    const auto impact = time_of_impact(*tree, *table, *landing, {.tolerance = 1e-6}, scratch);
    ASSERT_TRUE(impact);
    EXPECT_NEAR(impact->time, 0.5, 0.006);
    EXPECT_LE(impact->time, 0.5 + 1e-4);
  }
}

TEST(ContinuousShapeQueries, TransformsThatAreNotFiniteMeetNothing) {
  RandomStream stream(25, core::Purpose::kTest);
  const auto tree = tree_of(cloud(stream, 20));
  SweepScratch scratch;
  for (const std::unique_ptr<StaticShape>& shape : every_shape()) {
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
      Transform shifted;
      shifted.translation[1] = bad;
      Transform turned;
      turned.rotation[4] = bad;
      EXPECT_FALSE(time_of_impact(*tree, *shape, Transform(), shifted, scratch));
      EXPECT_FALSE(time_of_impact(*tree, *shape, turned, Transform(), scratch));
    }
  }
}

TEST(ContinuousShapeQueries, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations are not counted in this build";
  RandomStream stream(24, core::Purpose::kTest);
  const auto tree = tree_of(cloud(stream, 100));
  const Pose from = random_pose(stream, 1.0, 0.3);
  const Pose to = random_pose(stream, 1.0, 0.3);
  const auto motion = ScrewMotion::make(from, to);
  ASSERT_TRUE(motion.ok());
  const auto all = every_shape();
  SweepScratch scratch;
  const auto ask = [&] {
    for (const std::unique_ptr<StaticShape>& shape : all) {
      time_of_impact(*tree, *shape, *to_transform(from), *to_transform(to), scratch);
      time_of_impact(*tree, *shape, *motion, {}, scratch);
    }
  };
  ask();
  const auto before = tests::allocation_count();
  ask();
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace prescene::collision::continuous_shape_queries_test
