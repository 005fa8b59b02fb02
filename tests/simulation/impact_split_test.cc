// SPDX-License-Identifier: Apache-2.0
// Where steps are split, by hand: steps of 1/64 s, so that a part is 1/4096 s.
#include "prescene/simulation/rules/impact_split.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace prescene::simulation {
namespace {

constexpr double kStep = 1.0 / 64.0;
constexpr double kNever = std::numeric_limits<double>::infinity();

MechanicsOptions options_of_step() {
  MechanicsOptions options;
  options.step = kStep;
  return options;
}

TEST(ImpactSplit, IsWhenTheGapCloses) {
  const MechanicsOptions options = options_of_step();
  EXPECT_DOUBLE_EQ(split_time({.gap = 0.01, .speed = -2.0, .acceleration = 0.0, .reach = 0.1}, options), 0.005);
  // From rest it would take sqrt(2 h / g); thrown down at 3 m/s from 2 m: t = (sqrt(9 + 40) - 3) / 10.
  EXPECT_DOUBLE_EQ(split_time({.gap = 2.0, .speed = -3.0, .acceleration = -10.0, .reach = 0.1}, options), 0.4);
  EXPECT_EQ(split_time({.gap = 0.0, .speed = -2.0, .acceleration = 0.0, .reach = 0.1}, options), 0.0);
  EXPECT_EQ(split_time({.gap = -1e-4, .speed = -2.0, .acceleration = 0.0, .reach = 0.1}, options), 0.0);
  // It turns back before it arrives.
  EXPECT_EQ(split_time({.gap = 0.1, .speed = -0.5, .acceleration = 10.0, .reach = 0.1}, options), kNever);
}

TEST(ImpactSplit, LeavesAloneWhatDoesNotHit) {
  const MechanicsOptions options = options_of_step();
  EXPECT_EQ(split_time({.gap = 1e-4, .speed = 1.0, .acceleration = -10.0, .reach = 0.1}, options), kNever);
  EXPECT_EQ(split_time({.gap = 1e-4, .speed = -0.99 * options.restitution_speed, .reach = 1e-3}, options), kNever);
  EXPECT_NE(split_time({.gap = 1e-4, .speed = -1.01 * options.restitution_speed, .reach = 1e-3}, options), kNever);
  // Slow for its size.
  const double slowest = kSplitTravel * 5.0 / kStep;
  ASSERT_GT(slowest, options.restitution_speed);
  EXPECT_EQ(split_time({.gap = 1e-4, .speed = -0.99 * slowest, .reach = 5.0}, options), kNever);
  EXPECT_NE(split_time({.gap = 1e-4, .speed = -1.01 * slowest, .reach = 5.0}, options), kNever);
  // Jammed.
  EXPECT_EQ(split_time({.gap = -1.01 * options.touching_distance, .speed = -2.0, .reach = 0.1}, options), kNever);
}

TEST(ImpactSplit, PartsEndBeforeTheImpactAndGoOn) {
  const double part = kStep / kStepParts;
  EXPECT_EQ(parts_until(kNever, kStep, kStepParts), kStepParts);
  EXPECT_EQ(parts_until(kStep, kStep, kStepParts), kStepParts);
  EXPECT_EQ(parts_until(10.5 * part, kStep, kStepParts), 10);
  EXPECT_EQ(parts_until(0.5 * part, kStep, kStepParts), 1);
  EXPECT_EQ(parts_until(0.0, kStep, 7), 1);
  EXPECT_EQ(parts_until(0.0, kStep, 1), 1);
  EXPECT_EQ(parts_until(6.5 * part, kStep, 7), 6);
  EXPECT_EQ(parts_until(7.5 * part, kStep, 7), 7);
}

TEST(ImpactSplit, ARimThatLeansTouchesWhereItIsLowest) {
  using geometry::Vector3d;
  const Vector3d up = Vector3d::UnitZ();
  const Vector3d axis(std::sin(0.1), 0.0, std::cos(0.1));
  const Vector3d lowest(std::cos(0.1), 0.0, -std::sin(0.1));
  EXPECT_LT((lowest_of({axis, up, Vector3d::Zero()}) - lowest).norm(), 1e-12);
  EXPECT_LT((lowest_of({-axis, up, Vector3d::Zero()}) - lowest).norm(), 1e-12);
  EXPECT_TRUE(leans({axis, up, Vector3d::Zero()}));
  EXPECT_FALSE(leans({up, up, Vector3d::Zero()}));                 // stands
  EXPECT_FALSE(leans({Vector3d::UnitX(), up, Vector3d::Zero()}));  // lies
}

// The support point of a thick disc, by trying all around both rims.
TEST(ImpactSplit, ACylinderThatLeansTouchesWhereNoPointOfItsRimsIsLower) {
  using geometry::Vector3d;
  const Vector3d up = Vector3d(0.3, -0.2, 0.9).normalized();
  const Vector3d aside = up.cross(Vector3d(0.1, 1.0, 0.4)).normalized();
  for (const double lean : {0.05, 0.4, 0.7, 2.5, 3.0}) {
    const Vector3d axis = std::cos(lean) * up + std::sin(lean) * aside;
    const LeaningRim rim{axis, up, Vector3d(0.4, 2.0, -1.0)};
    ASSERT_TRUE(leans(rim)) << lean;
    const RimPair rims{{0.2, 0.1, -0.3}, 0.05, 0.09, -0.04, 0.003};
    const Vector3d x = axis.cross(Vector3d::UnitX()).normalized(), y = axis.cross(x);
    double lowest = kNever;
    Vector3d where = Vector3d::Zero();
    for (int i = 0; i < 100000; ++i) {
      const double turn = 1e-5 * 2.0 * M_PI * i;
      for (const double z : {rims.upper, rims.lower}) {
        const Vector3d p =
            rims.middle + z * axis + rims.radius * (std::cos(turn) * x + std::sin(turn) * y) - rims.rounding * up;
        if (p.dot(up) < lowest) lowest = p.dot(up), where = p;
      }
    }
    EXPECT_LT((lowest_of(rim, rims) - where).norm(), 1e-5) << lean;
    EXPECT_EQ(roll_time(rim, rims, where, 1e-4), roll_time(rim)) << lean;
    EXPECT_EQ(roll_time(rim, rims, where + 2e-4 * axis, 1e-4), kNever) << lean;
  }
  const RimPair flat{Vector3d::Zero(), 0.05, 0.01, -0.01, 0.001};
  EXPECT_EQ(roll_time({up, up, aside}, flat, -0.011 * up, 1.0), kNever);  // stands
}

TEST(ImpactSplit, ARimIsRolledOverAsFastAsItTurnsBelowTheNormal) {
  using geometry::Vector3d;
  const Vector3d up = Vector3d::UnitZ();
  const Vector3d axis(std::sin(0.1), 0.0, std::cos(0.1));
  // About its own axis the whole rim passes; about the normal, as a whirling coin seen from above, none of it.
  EXPECT_NEAR(roll_time({axis, up, 5.0 * axis}), kSplitRoll / 5.0, 1e-12);
  EXPECT_GT(roll_time({axis, up, 5.0 * up}), 1e9);
  EXPECT_GT(roll_time({axis, up, 5.0 * Vector3d::UnitY()}), 1e9);  // it only tilts further
  // Tilting aside: the normal goes by w t across the rim's plane, where it is sin(tilt) long.
  EXPECT_NEAR(roll_time({axis, up, 2.0 * Vector3d::UnitX()}), kSplitRoll * std::sin(0.1) / 2.0, 1e-12);
  // A rim at rest never goes on.
  EXPECT_EQ(roll_time({axis, up, Vector3d::Zero()}), kNever);
}

TEST(ImpactSplit, BoundsTheWorkOfAStep) {
  EXPECT_EQ(most_splits(0), 16);
  EXPECT_EQ(most_splits(4), 16);
  EXPECT_EQ(most_splits(64), 1);
  EXPECT_EQ(most_splits(65), 0);
  for (int objects = 1; objects < 200; ++objects) {
    EXPECT_LE(objects * most_splits(objects), 64);
    EXPECT_LE(most_splits(objects + 1), most_splits(objects));
  }
}

}  // namespace
}  // namespace prescene::simulation
