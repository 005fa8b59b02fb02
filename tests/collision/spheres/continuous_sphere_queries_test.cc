// SPDX-License-Identifier: Apache-2.0
// Times of impact against motions looked at in small steps.
#include "prescene/collision/spheres/continuous_sphere_queries.h"

#include <gtest/gtest.h>

#include <hwy/highway.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "tests/support/allocations.h"

namespace prescene::collision::continuous_sphere_queries_test {
namespace {

using core::RandomStream;
using Eigen::Vector3d;
using geometry::Pose;

std::shared_ptr<const SphereTree> tree_of(const std::vector<PackedSphere>& spheres, int branching) {
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

/// Spheres of many sizes within a box of half a metre.
std::vector<PackedSphere> cloud(RandomStream& stream, int count) {
  std::vector<PackedSphere> spheres;
  for (int i = 0; i < count; ++i)
    spheres.push_back({random_vector(stream, 0.25).cast<float>(), static_cast<float>(stream.uniform(0.005, 0.04))});
  return spheres;
}

std::vector<PackedSphere> plate(int across, float radius) {
  std::vector<PackedSphere> spheres;
  for (int x = 0; x < across; ++x) {
    for (int y = 0; y < across; ++y) {
      const float middle = 0.5F * static_cast<float>(across - 1);
      spheres.push_back(
          {2.0F * radius * Vector3f(static_cast<float>(x) - middle, static_cast<float>(y) - middle, 0.0F), radius});
    }
  }
  return spheres;
}

/// The least gap of all pairs when B's centres are where `place` puts them.
template <class Place>
double least_gap(const std::vector<PackedSphere>& a, const std::vector<PackedSphere>& b, const Place& place) {
  double least = std::numeric_limits<double>::infinity();
  for (const PackedSphere& of_b : b) {
    const Vector3d p = place(of_b.centre.cast<double>());
    for (const PackedSphere& of_a : a) {
      const double radii = static_cast<double>(of_a.radius) + static_cast<double>(of_b.radius);
      least = std::min(least, (p - of_a.centre.cast<double>()).norm() - radii);
    }
  }
  return least;
}

Transform transform_of(const Pose& X) { return *to_transform(X); }

Vector3d placed(const Transform& X, const Vector3d& c) {
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> R(X.rotation.data());
  return R.cast<double>() * c + Eigen::Map<const Vector3f>(X.translation.data()).cast<double>();
}

Pose random_pose(RandomStream& stream, double reach) {
  return {geometry::exp_rotation(random_vector(stream, 1.7)), random_vector(stream, reach)};
}

TEST(SweptSpheresContact, HasTheKnownTimes) {
  const Vector3d x = Vector3d::UnitX();
  EXPECT_EQ(swept_spheres_contact(4.0 * x, Vector3d::Zero(), 1.0), 0.75);
  EXPECT_EQ(swept_spheres_contact(4.0 * x, -40.0 * x, 1.0), 3.0 / 44.0);
  EXPECT_EQ(swept_spheres_contact(4.0 * x, 1.0 * x, 1.0), 1.0);  // at the very end
  EXPECT_FALSE(swept_spheres_contact(4.0 * x, 1.01 * x, 1.0));   // not far enough
  EXPECT_FALSE(swept_spheres_contact(4.0 * x, 5.0 * x, 1.0));    // apart
  EXPECT_EQ(swept_spheres_contact(0.5 * x, 5.0 * x, 1.0), 0.0);  // clamped to the start
  EXPECT_EQ(swept_spheres_contact(x, 5.0 * x, 1.0), 0.0);        // touching at the start
  EXPECT_FALSE(swept_spheres_contact(4.0 * x, 4.0 * x, 1.0));    // side by side, no relative motion
  EXPECT_EQ(swept_spheres_contact(0.9 * x, 0.9 * x, 1.0), 0.0);
  const Vector3d beside(-3.0, 1.0, 0.0);
  EXPECT_NEAR(swept_spheres_contact(beside, beside + 6.0 * x, 1.0).value_or(-1.0), 0.5, 1e-12);  // grazing
  EXPECT_FALSE(swept_spheres_contact(beside + 1e-9 * Vector3d::UnitY(), beside + 6.0 * x, 1.0 - 1e-8));
}

TEST(ScrewMotion, GoesFromStartToEndAndBackAlongTheInverse) {
  RandomStream stream(3, core::Purpose::kTest);
  for (int i = 0; i < 200; ++i) {
    const Pose X_AB = random_pose(stream, 1.0);
    Pose X_end = random_pose(stream, 1.0);
    if (i % 3 == 0)
      X_end = X_AB * Pose{geometry::exp_rotation(random_vector(stream, 1e-4)), random_vector(stream, 1.0)};
    if (i % 10 == 0) X_end.rotation = X_AB.rotation;
    const auto motion = ScrewMotion::make(X_AB, X_end);
    const auto back = ScrewMotion::make(X_AB.inverse(), X_end.inverse());
    ASSERT_TRUE(motion.ok() && back.ok());
    EXPECT_LE(geometry::box_minus(motion->pose(1.0), X_end).norm(), 1e-9);
    const Vector3d p_BQ = random_vector(stream, 0.3);
    for (const double t : {0.0, 0.3, 0.9}) {
      EXPECT_LE((motion->pose(t) * p_BQ - motion->place(X_AB * p_BQ, t)).norm(), 1e-12);
      EXPECT_LE((motion->pose(t) * (back->pose(t) * p_BQ) - p_BQ).norm(), 1e-9);
      // The bound of what the path leaves a chord by.
      const Vector3d from = motion->place(X_AB * p_BQ, t);
      const Vector3d to = motion->place(X_AB * p_BQ, t + 0.1);
      for (const double share : {0.2, 0.5, 0.7}) {
        const Vector3d off = motion->place(X_AB * p_BQ, t + 0.1 * share) - (from + share * (to - from));
        EXPECT_LE(off.norm(), 0.125 * 0.01 * motion->bend(X_AB * p_BQ) * (1.0 + 1e-9) + 1e-15);
      }
      EXPECT_LE((to - from).norm(), 0.1 * motion->speed(X_AB * p_BQ) * (1.0 + 1e-9));
    }
  }
  EXPECT_FALSE(ScrewMotion::make(Pose::from_translation({std::nan(""), 0, 0}), Pose::identity()).ok());
}

TEST(ContinuousSphereQueries, StraightMotionsMeetWhenTheFirstPairDoes) {
  RandomStream stream(5, core::Purpose::kTest);
  SweepScratch scratch;
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const auto a = cloud(stream, 60);
    const auto b = cloud(stream, 60);
    const int branching = i % 3 == 0 ? 4 : (i % 3 == 1 ? 8 : 16);
    const auto tree_a = tree_of(a, branching);
    const auto tree_b = tree_of(b, branching);
    const Transform start = transform_of(random_pose(stream, 1.0));
    const Transform end = transform_of(random_pose(stream, 1.0));
    double expected = 2.0;
    for (const PackedSphere& of_b : b) {
      const Vector3d c = of_b.centre.cast<double>();
      for (const PackedSphere& of_a : a) {
        const Vector3d from = placed(start, c) - of_a.centre.cast<double>();
        const Vector3d to = placed(end, c) - of_a.centre.cast<double>();
        const double radii = static_cast<double>(of_a.radius) + static_cast<double>(of_b.radius);
        expected = std::min(expected, swept_spheres_contact(from, to, radii).value_or(2.0));
      }
    }
    const auto impact = time_of_impact(*tree_a, *tree_b, start, end, scratch);
    ASSERT_EQ(impact.has_value(), expected <= 1.0);
    if (!impact) continue;
    ++hits;
    EXPECT_EQ(impact->time, expected);
    // The point is on both spheres.
    const PackedSphere& of_b = b[impact->sphere_b];
    const Vector3d c = of_b.centre.cast<double>();
    const Vector3d at = (1.0 - expected) * placed(start, c) + expected * placed(end, c);
    if (expected > 0.0) {
      EXPECT_NEAR((impact->point - at).norm(), static_cast<double>(of_b.radius), 1e-9);
      EXPECT_NEAR((impact->point - a[impact->sphere_a].centre.cast<double>()).norm(),
                  static_cast<double>(a[impact->sphere_a].radius), 1e-9);
    }
  }
  EXPECT_GT(hits, 100);
  EXPECT_LT(hits, 299);
}

TEST(ContinuousSphereQueries, TooSmallTolerancesAreReplaced) {
  RandomStream stream(7, core::Purpose::kTest);
  SweepScratch scratch;
  const std::vector<PackedSphere> spheres = cloud(stream, 30);
  const auto a = tree_of(spheres, 4);
  const auto b = a;
  const Vector3d way = 20.0 * Vector3d::UnitX();
  const auto motion = ScrewMotion::make({geometry::Quaterniond::Identity(), way},
                                        {geometry::exp_rotation(Vector3d(0.0, 0.0, 0.01)), -way});
  ASSERT_TRUE(motion.ok());
  const auto expected = time_of_impact(*a, *b, *motion, {.tolerance = kLeastImpactTolerance}, scratch);
  ASSERT_TRUE(expected.has_value());
  for (const double tolerance : {0.0, -1.0, std::nan("")})
    EXPECT_EQ(time_of_impact(*a, *b, *motion, {.tolerance = tolerance}, scratch)->time, expected->time);
}

TEST(ContinuousSphereQueries, ScrewsStopBeforeTheFirstContactAndAtIt) {
  RandomStream stream(6, core::Purpose::kTest);
  SweepScratch scratch;
  constexpr ImpactOptions kOptions = {.tolerance = 1e-6};
  int hits = 0;
  for (int i = 0; i < 150; ++i) {
    const auto a = cloud(stream, 30);
    const auto b = cloud(stream, 30);
    const auto tree_a = tree_of(a, i % 2 == 0 ? 4 : 16);
    const auto tree_b = tree_of(b, 16);
    Pose from = random_pose(stream, 0.2);
    Pose to = random_pose(stream, 0.4);
    from.translation += Vector3d(0.8, 0.0, 0.0);
    to.translation += Vector3d(i % 5 == 0 ? 0.9 : 0.2, 0.3, 0.0);
    const auto motion = ScrewMotion::make(from, to);
    ASSERT_TRUE(motion.ok());
    const auto impact = time_of_impact(*tree_a, *tree_b, *motion, kOptions, scratch);
    const double until = impact ? impact->time : 1.0;
    const auto gap_at = [&](double t) {
      return least_gap(a, b, [&](const Vector3d& c) { return motion->place(motion->start() * c, t); });
    };
    for (int k = 0; until > 0.0 && k < 200; ++k) ASSERT_GT(gap_at(until * k / 200.0), 0.0);
    if (!impact) {
      ASSERT_GT(gap_at(1.0), 0.0);
      continue;
    }
    ++hits;
    EXPECT_LE(gap_at(until), kOptions.tolerance + 1e-12);
    // The same seen from B.
    const auto back = ScrewMotion::make(from.inverse(), to.inverse());
    ASSERT_TRUE(back.ok());
    const auto same = time_of_impact(*tree_b, *tree_a, *back, kOptions, scratch);
    ASSERT_TRUE(same);
    EXPECT_LE(gap_at(same->time), kOptions.tolerance + 1e-12);
    // Reversed: the contact that is met first is the last of the motion.
    const auto reversed = ScrewMotion::make(to, from);
    ASSERT_TRUE(reversed.ok());
    const auto last = time_of_impact(*tree_a, *tree_b, *reversed, kOptions, scratch);
    ASSERT_TRUE(last);
    EXPECT_LE(until, 1.0 - last->time + 1e-6);
    if (last->time == 0.0) continue;  // in contact at the end
    for (int k = 1; k <= 50; ++k) ASSERT_GT(gap_at(1.0 - last->time + last->time * k / 50.0), 0.0);
  }
  std::printf("%d of 150 screws meet\n", hits);
  EXPECT_GT(hits, 60);
  EXPECT_LT(hits, 150);
}

TEST(ContinuousSphereQueries, NothingPassesThroughAThinPlate) {
  const auto thin = plate(24, 0.002F);
  const std::vector<PackedSphere> bullet = {{Vector3f::Zero(), 0.003F}};
  const auto tree_a = tree_of(thin, 16);
  const auto tree_b = tree_of(bullet, 4);
  SweepScratch scratch;
  // Ten thousand times the plate's thickness in one step.
  const Pose from = Pose::from_translation({0.001, 0.0005, 20.0});
  const Pose to = Pose::from_translation({0.001, 0.0005, -20.0});
  const auto straight = time_of_impact(*tree_a, *tree_b, transform_of(from), transform_of(to), scratch);
  ASSERT_TRUE(straight);
  EXPECT_NEAR(straight->time, 0.5 - 0.004 / 40.0, 3e-5);
  EXPECT_GT(straight->normal.z(), 0.5);
  // Half a turn about the y axis, a metre away: starts and ends at the plate's height on the other side.
  const Pose X_turned = Pose{geometry::exp_rotation({0, std::numbers::pi - 1e-3, 0}), Vector3d(0.0, 0.0, 0.0)};
  const Pose before = Pose::from_translation({0.7, 0.0, -0.7});
  const auto motion = ScrewMotion::make(before, X_turned * before);
  ASSERT_TRUE(motion.ok());
  std::vector<PackedSphere> wall;
  for (const PackedSphere& sphere : thin) wall.push_back({sphere.centre + Vector3f(-0.7F, 0.0F, -0.7F), sphere.radius});
  const auto turning = time_of_impact(*tree_of(wall, 8), *tree_b, *motion, {}, scratch);
  ASSERT_TRUE(turning);
  EXPECT_GT(turning->time, 0.4);
  EXPECT_LT(turning->time, 0.51);
}

TEST(ContinuousSphereQueries, EveryInstructionSetAnswersAlike) {
  RandomStream stream(8, core::Purpose::kTest);
  SweepScratch scratch;
  for (int i = 0; i < 60; ++i) {
    const auto tree_a = tree_of(cloud(stream, 100), i % 3 == 0 ? 4 : (i % 3 == 1 ? 8 : 16));
    const auto tree_b = tree_of(cloud(stream, 100), i % 3 == 0 ? 4 : (i % 3 == 1 ? 8 : 16));
    const Pose from = random_pose(stream, 0.8);
    const Pose to = random_pose(stream, 0.8);
    const auto motion = ScrewMotion::make(from, to);
    ASSERT_TRUE(motion.ok());
    const auto straight = time_of_impact(*tree_a, *tree_b, transform_of(from), transform_of(to), scratch);
    const auto turning = time_of_impact(*tree_a, *tree_b, *motion, {}, scratch);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().DeInit();
      const auto straight_again = time_of_impact(*tree_a, *tree_b, transform_of(from), transform_of(to), scratch);
      const auto turning_again = time_of_impact(*tree_a, *tree_b, *motion, {}, scratch);
      ASSERT_EQ(straight_again.has_value(), straight.has_value()) << hwy::TargetName(target);
      ASSERT_EQ(turning_again.has_value(), turning.has_value()) << hwy::TargetName(target);
      if (straight) {
        EXPECT_EQ(straight_again->time, straight->time);
        EXPECT_EQ(straight_again->sphere_a, straight->sphere_a);
        EXPECT_EQ(straight_again->sphere_b, straight->sphere_b);
      }
      if (turning) {
        EXPECT_EQ(turning_again->time, turning->time);
      }
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
  }
}

TEST(ContinuousSphereQueries, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations are not counted in this build";
  RandomStream stream(9, core::Purpose::kTest);
  const auto tree_a = tree_of(cloud(stream, 100), 16);
  const auto tree_b = tree_of(cloud(stream, 100), 16);
  const Pose end = random_pose(stream, 0.8), begin = random_pose(stream, 0.8);
  const auto motion = ScrewMotion::make(begin, end);
  ASSERT_TRUE(motion.ok());
  SweepScratch scratch;
  time_of_impact(*tree_a, *tree_b, *motion, {}, scratch);
  const auto before = tests::allocation_count();
  time_of_impact(*tree_a, *tree_b, *motion, {}, scratch);
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace prescene::collision::continuous_sphere_queries_test
