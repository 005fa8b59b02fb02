// SPDX-License-Identifier: Apache-2.0
// Scenes whose answer physics knows: by symmetry, or within a range.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "recorded_scenario.h"
#include "tests/support/paths.h"

namespace prescene::tests {
namespace {

constexpr int kInstances = 2048;

std::map<std::string, belief::OutcomeProbability> foreseen(const std::string& name, int instances = kInstances) {
  std::map<std::string, belief::OutcomeProbability> found;
  const auto scene = scenario(name);
  if (scene == nullptr) return found;
  const belief::Answer answer = predict(scene, instances, 1, 2);
  EXPECT_TRUE(answer.error.ok()) << answer.error.message();
  const auto& predicted = std::get<belief::PredictAnswer>(answer.what);
  EXPECT_EQ(predicted.failed_instances, 0);
  EXPECT_EQ(predicted.overlapping_share, 0.0);
  for (const belief::OutcomeProbability& outcome : predicted.outcomes) found[outcome.name] = outcome;
  return found;
}

double half_width(const belief::OutcomeProbability& outcome) { return 0.5 * (outcome.high - outcome.low); }

/// Share of all directions under which a side of a box is seen from its centre.
double solid_angle_share(double a, double b, double distance) {
  return std::atan(a * b / (2.0 * distance * std::sqrt(4.0 * distance * distance + a * a + b * b))) / std::numbers::pi;
}

TEST(PhysicalTolerance, ACoinsSidesAreAlike) {
  auto side = foreseen("tossed_coin");
  ASSERT_EQ(side.size(), 4u);
  // Two standard errors of a difference of two shares, and 0.03 that the solver's thin rims may be off by.
  EXPECT_NEAR(side["heads"].probability, side["tails"].probability, 2.0 * half_width(side["heads"]) + 0.03);
  EXPECT_LT(side["edge"].probability, 0.06);
}

TEST(PhysicalTolerance, AThickCoinsEndsAreAlikeAndItsEdgeIsASide) {
  auto side = foreseen("tossed_thick_coin");
  ASSERT_EQ(side.size(), 4u);
  EXPECT_NEAR(side["heads"].probability, side["tails"].probability, 2.0 * half_width(side["heads"]));
  // Its rim is seen from the centre under h / sqrt(h^2 + d^2) = 0.50 of all directions. Standing on it is less steady
  // than lying, which tumbling takes off, but not half of it.
  EXPECT_GT(side["edge"].probability, 0.25);
  EXPECT_LT(side["edge"].probability, 0.55);
}

TEST(PhysicalTolerance, ACubeFromAnywhereShowsEachFaceOnceInSix) {
  auto up = foreseen("tossed_cube");
  ASSERT_EQ(up.size(), 7u);
  for (const char* face : {"+x", "-x", "+y", "-y", "+z", "-z"}) {
    EXPECT_LE(up[face].low - 0.01, 1.0 / 6.0) << face;  // 0.01: six intervals of 95 % at once
    EXPECT_GE(up[face].high + 0.01, 1.0 / 6.0) << face;
  }
}

TEST(PhysicalTolerance, AnUnequalBoxPrefersItsLargeFacesBeyondTheirSolidAngles) {
  auto up = foreseen("tossed_unequal_box");
  ASSERT_EQ(up.size(), 7u);
  const double x = up["+x"].probability + up["-x"].probability, y = up["+y"].probability + up["-y"].probability,
               z = up["+z"].probability + up["-z"].probability;
  EXPECT_NEAR(up["+z"].probability, up["-z"].probability, 2.0 * half_width(up["+z"]));
  EXPECT_NEAR(up["+y"].probability, up["-y"].probability, 2.0 * half_width(up["+y"]));
  EXPECT_GT(z, 2.0 * solid_angle_share(0.12, 0.08, 0.025));
  EXPECT_LT(x, 2.0 * solid_angle_share(0.08, 0.05, 0.06));
  EXPECT_GT(z, y);
  EXPECT_GT(y, x);
  EXPECT_GT(x, 0.0);
}

TEST(PhysicalTolerance, BallsOnAPlateAreAlikeInAllDirections) {
  auto falls = foreseen("plate_of_balls", 512);
  ASSERT_EQ(falls.size(), 4u);
  double mean = 0.0;
  for (const auto& [name, outcome] : falls) mean += 0.25 * outcome.probability;
  EXPECT_GT(mean, 0.02);
  EXPECT_LT(mean, 0.5);
  for (const auto& [name, outcome] : falls)
    EXPECT_NEAR(outcome.probability, mean, 1.5 * half_width(outcome) + 0.01) << name;
}

}  // namespace
}  // namespace prescene::tests
