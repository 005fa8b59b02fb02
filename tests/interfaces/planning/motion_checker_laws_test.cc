// SPDX-License-Identifier: Apache-2.0
// Motions that are called free are free in dense samples by brute force; those that are called blocked come within the
// tolerance in them.
#include "prescene/interfaces/planning/motion_checker.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>

#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "tests/support/brute_force.h"
#include "tests/support/collision_meshes.h"

namespace prescene::interfaces::motion_checker_laws_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;
using testing::HasSubstr;
using Configuration = std::array<double, 7>;

PlanningShape shape_of(const geometry::TriangleMesh& mesh) {
  core::ThreadPool pool(1);
  auto shape = PlanningShape::of_mesh(mesh, "mesh", pool);
  PRESCENE_CHECK(shape.ok());
  return *std::move(shape);
}

PlanningShape box_shape(double x, double y, double z) {
  return shape_of(geometry::make_mesh(geometry::BoxShape{{x, y, z}}));
}

std::shared_ptr<const MotionChecker> checker_of(PlanningShape body, std::vector<Obstacle> obstacles,
                                                const MotionCheckOptions& options) {
  auto checker =
      MotionChecker::make(std::make_shared<const RigidBody>("body", std::move(body)), std::move(obstacles), options);
  PRESCENE_CHECK(checker.ok());
  return *std::move(checker);
}

/// A knot, a ball, and a plate a tenth of a millimetre thick.
std::vector<Obstacle> some_obstacles() {
  return {{"knot", shape_of(tests::make_knot(0.15, 200)), Pose::from_translation({0.2, 0.1, 0.0})},
          {"ball", shape_of(tests::make_bumpy_sphere(0.12, 100)), Pose::from_translation({-0.2, 0.0, 0.1})},
          {"plate", box_shape(0.0001, 0.3, 0.3), Pose::from_translation({0.0, 0.0, 0.3})}};
}

Configuration random_configuration(core::RandomStream& random) {
  const double turn_z = random.normal(), turn_y = random.normal(), turn_x = random.normal();
  const Vector3d turn(turn_x, turn_y, turn_z);
  const auto coordinate = [&] { return 1.2 * (random.uniform() - 0.5); };
  const double z = coordinate(), y = coordinate(), x = coordinate();
  const Vector3d p(x, y, z);
  return RigidBody::configuration({geometry::exp_rotation(turn), p});
}

/// Least distance of the body from the obstacles at the time t, by brute force; `limit` where it is more.
double distance_at(const MotionChecker& checker, const Configuration& q0, const Configuration& q1, double t,
                   double limit) {
  Configuration q{};
  checker.mover().between(q0, q1, t, q);
  const Pose X_WB = RigidBody::pose(q);
  double least = limit;
  for (const Obstacle& obstacle : checker.obstacles()) {
    const auto X_OB = collision::relative_transform(obstacle.X_WO, X_WB);
    least = std::min(least, tests::distance_by_brute_force(obstacle.shape.triangles()->mesh(),
                                                           checker.mover().shapes().front().shape.triangles()->mesh(),
                                                           *X_OB, least));
  }
  return least;
}

struct Tally {
  int free = 0, blocked = 0;
};

/// `samples` of each of so many motions with free ends, as dense as their way is short.
Tally check_motions(double margin, int motions, int samples) {
  const MotionCheckOptions options{.margin = margin, .tolerance = 2e-3, .step_limit = 20'000};
  const auto checker = checker_of(box_shape(0.05, 0.08, 0.11), some_obstacles(), options);
  core::RandomStream random(11, core::Purpose::kTest);
  PlanningScratch scratch;
  Tally tally;
  while (tally.free + tally.blocked < motions) {
    const Configuration q0 = random_configuration(random), q1 = random_configuration(random);
    if (!checker->is_free(q0, scratch) || !checker->is_free(q1, scratch)) continue;
    const MotionCheck any = checker->check(q0, q1, scratch);
    const MotionCheck earliest = checker->check(q0, q1, scratch, MotionChecker::Order::kEarliest);
    EXPECT_EQ(any.outcome, earliest.outcome);
    const double spacing = checker->mover().way(0, std::nullopt, q0, q1) / samples;
    const double near = margin + options.tolerance + spacing;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= samples; ++i) {
      const double t = static_cast<double>(i) / samples;
      const double there = distance_at(*checker, q0, q1, t, near);
      least = std::min(least, there);
      if (t < earliest.free_until) {
        EXPECT_TRUE(margin > 0.0 ? there > margin : there > 0.0) << t << " of " << earliest.free_until;
      }
    }
    if (any.outcome == MotionCheck::kFree) {
      ++tally.free;
    } else {
      ++tally.blocked;
      EXPECT_LT(least, near);
    }
  }
  return tally;
}

TEST(MotionCheckerLaws, FreeMotionsAreFreeInDenseSamples) {
  const Tally tally = check_motions(0.0, 60, 100);
  EXPECT_GT(tally.free, 10);
  EXPECT_GT(tally.blocked, 10);
}

TEST(MotionCheckerLaws, FreeMotionsKeepTheirMargin) {
  const Tally tally = check_motions(0.02, 60, 100);
  EXPECT_GT(tally.free, 10);
  EXPECT_GT(tally.blocked, 10);
}

// The two ways to the same answer: first contacts, and cutting with next to no margin.
TEST(MotionCheckerLaws, FirstContactsAndCuttingAgree) {
  const auto exact = checker_of(box_shape(0.05, 0.08, 0.11), some_obstacles(), {});
  const MotionCheckOptions options{.margin = 1e-9, .tolerance = 1e-5, .step_limit = 1'000'000};
  const auto cutting = checker_of(box_shape(0.05, 0.08, 0.11), some_obstacles(), options);
  core::RandomStream random(12, core::Purpose::kTest);
  PlanningScratch scratch;
  for (int i = 0; i < 300;) {
    const Configuration q0 = random_configuration(random), q1 = random_configuration(random);
    if (!exact->is_free(q0, scratch)) continue;
    ++i;
    const MotionCheck first = exact->check(q0, q1, scratch, MotionChecker::Order::kEarliest);
    const MotionCheck cut = cutting->check(q0, q1, scratch, MotionChecker::Order::kEarliest);
    ASSERT_EQ(first.outcome, cut.outcome);
    // Never later than the contact; before it by no more than how far things are still apart then.
    ASSERT_LE(cut.free_until, first.free_until + 1e-3);
    ASSERT_EQ(exact->check(q0, q1, scratch).outcome, first.outcome);
  }
}

TEST(MotionCheckerLaws, NoPlateIsTooThin) {
  // Two triangles without any thickness.
  geometry::TriangleMesh sheet;
  sheet.vertices = {{0.0, -0.5, -0.5}, {0.0, 0.5, -0.5}, {0.0, 0.5, 0.5}, {0.0, -0.5, 0.5}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const double margin : {0.0, 0.001}) {
    const auto checker =
        checker_of(box_shape(0.002, 0.002, 0.002), {{"sheet", shape_of(sheet), Pose::identity()}}, {.margin = margin});
    PlanningScratch scratch;
    core::RandomStream random(13, core::Purpose::kTest);
    for (int i = 0; i < 200; ++i) {
      const double z = 0.8 * (random.uniform() - 0.5), y = 0.8 * (random.uniform() - 0.5);
      const Vector3d p(0.0, y, z);
      const double way_z = random.normal(), way_y = random.normal(), way_x = 50.0 * (0.1 + random.uniform());
      const Vector3d way(way_x, way_y, way_z);
      const Configuration q0 = RigidBody::configuration(Pose::from_translation(p - random.uniform() * way));
      const Configuration q1 = RigidBody::configuration(Pose::from_translation(p + random.uniform() * way));
      if (!checker->is_free(q0, scratch) || !checker->is_free(q1, scratch)) continue;
      ASSERT_EQ(checker->check(q0, q1, scratch).outcome, MotionCheck::kBlocked) << i;
    }
  }
}

TEST(MotionCheckerLaws, SpheresDoNotPassThroughAPlate) {
  core::ThreadPool pool(1);
  const auto mesh = tests::collision_mesh(geometry::make_mesh(geometry::Sphere{0.01}), "ball");
  collision::PackingOptions packing;
  packing.max_spheres = 50;
  const auto packed = collision::pack_spheres(*mesh, packing, pool);
  ASSERT_TRUE(packed.ok());
  const auto checker = checker_of(PlanningShape::of_spheres(*collision::SphereTree::make(packed->packing, {}, pool)),
                                  {{"plate", box_shape(0.0001, 1.0, 1.0), Pose::identity()}}, {});
  PlanningScratch scratch;
  const auto at = [](double x, double y) { return RigidBody::configuration(Pose::from_translation({x, y, 0.0})); };
  EXPECT_EQ(checker->check(at(-3.0, 0.0), at(2.0, 0.1), scratch).outcome, MotionCheck::kBlocked);
  EXPECT_EQ(checker->check(at(-3.0, 0.0), at(-0.012, 0.1), scratch).outcome, MotionCheck::kFree);
  EXPECT_FALSE(checker->is_free(at(0.0, 0.0), scratch));
}

TEST(MotionCheckerLaws, ClearanceIsTheLeastDistanceLessTheMargin) {
  const double margin = 0.01;
  const auto checker = checker_of(box_shape(0.05, 0.08, 0.11), some_obstacles(), {.margin = margin});
  core::RandomStream random(14, core::Purpose::kTest);
  PlanningScratch scratch;
  int free = 0;
  for (int i = 0; i < 100; ++i) {
    const Configuration q = random_configuration(random);
    const double clearance = checker->clearance(q, scratch);
    if (!checker->is_free(q, scratch)) {
      ASSERT_EQ(clearance, 0.0);
      continue;
    }
    ++free;
    const double expected = distance_at(*checker, q, q, 0.0, 10.0) - margin;
    ASSERT_LE(clearance, expected + 1e-12);
    ASSERT_GE(clearance, expected - 2e-5);
  }
  EXPECT_GT(free, 30);
}

TEST(MotionCheckerLaws, GivesUpAtItsLimitAndSaysSo) {
  const auto checker = checker_of(box_shape(0.05, 0.05, 0.05), {{"plate", box_shape(1.0, 1.0, 0.01), Pose::identity()}},
                                  {.margin = 0.01, .tolerance = 1e-6, .step_limit = 20});
  PlanningScratch scratch;
  // Along the plate, a hundredth of a millimetre outside of the margin.
  const auto at = [](double x) { return RigidBody::configuration(Pose::from_translation({x, 0.0, 0.04001})); };
  const MotionCheck answer = checker->check(at(-0.3), at(0.3), scratch);
  EXPECT_EQ(answer.outcome, MotionCheck::kStepLimit);
  EXPECT_LE(answer.steps, 20U);
}

TEST(MotionCheckerLaws, RefusesWhatIsWrongAndNamesIt) {
  const auto mover = std::make_shared<const RigidBody>("body", box_shape(0.1, 0.1, 0.1));
  const auto error = [&](std::vector<Obstacle> obstacles, const MotionCheckOptions& options) {
    return MotionChecker::make(mover, std::move(obstacles), options).status().message();
  };
  EXPECT_THAT(error({}, {.margin = -0.1}), HasSubstr("margin: "));
  EXPECT_THAT(error({}, {.margin = std::nan("")}), HasSubstr("margin: "));
  EXPECT_THAT(error({}, {.margin = 0.0, .tolerance = 0.0}), HasSubstr("tolerance: "));
  EXPECT_THAT(error({}, {.margin = 0.0, .tolerance = 0.001, .step_limit = 0}), HasSubstr("step_limit"));
  EXPECT_THAT(error({{"wall", box_shape(1, 1, 1), Pose::from_translation({std::nan(""), 0, 0})}}, {}),
              HasSubstr("obstacle 'wall'"));
  EXPECT_THAT(MotionChecker::make(nullptr, {}, {}).status().message(), HasSubstr("no mover"));
  const auto checker = checker_of(box_shape(0.1, 0.1, 0.1), {}, {});
  PlanningScratch scratch;
  Configuration q = RigidBody::configuration(Pose::identity());
  EXPECT_TRUE(checker->is_free(q, scratch));
  q[1] = std::nan("");
  EXPECT_FALSE(checker->is_free(q, scratch));
  EXPECT_EQ(checker->check(q, q, scratch).outcome, MotionCheck::kBlocked);
}

TEST(MotionCheckerLaws, AQuaternionMayHaveAnyLengthButZero) {
  // A plate that the body meets in one attitude of two, 1 cm from its origin.
  const auto checker = checker_of(
      box_shape(0.1, 0.1, 0.01), {{"plate", box_shape(1.0, 1.0, 0.002), Pose::from_translation({0.0, 0.0, 0.01})}}, {});
  const Vector3d quarter(0.5 * std::numbers::pi, 0.0, 0.0);
  PlanningScratch scratch;
  const auto scaled = [](const Vector3d& turn, double length) {
    Configuration q = RigidBody::configuration({geometry::exp_rotation(turn), Vector3d::Zero()});
    for (std::size_t i = 3; i < q.size(); ++i) q[i] *= length;
    return q;
  };
  for (const double length : {1.0, 1e-3, 7.0, 1e100}) {
    EXPECT_TRUE(checker->is_free(scaled(Vector3d::Zero(), length), scratch)) << length;
    EXPECT_FALSE(checker->is_free(scaled(quarter, length), scratch)) << length;
  }
  const Configuration sound = scaled(Vector3d::Zero(), 1.0);
  for (const double length : {0.0, 1e-200, 1e300}) {
    const Configuration bad = scaled(Vector3d::Zero(), length);
    EXPECT_FALSE(checker->is_free(bad, scratch)) << length;
    EXPECT_EQ(checker->clearance(bad, scratch), 0.0) << length;
    EXPECT_EQ(checker->check(sound, bad, scratch).outcome, MotionCheck::kBlocked) << length;
    EXPECT_EQ(checker->check(bad, sound, scratch).outcome, MotionCheck::kBlocked) << length;
    const auto home =
        MotionChecker::make(std::make_shared<const RigidBody>("body", box_shape(0.1, 0.1, 0.1)), {}, {}, bad);
    EXPECT_THAT(home.status().message(), HasSubstr("home: give 7 finite numbers"));
  }
}

}  // namespace
}  // namespace prescene::interfaces::motion_checker_laws_test
