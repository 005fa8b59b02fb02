// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/infer_release.h"

#include <gtest/gtest.h>

#include "simulated_sequence.h"

namespace prescene::filter_tests {
namespace {

using belief::MotionMode;

/// A hand holds a box; both rise by 1 cm a frame.
class InferRelease : public ::testing::Test {
 protected:
  InferRelease() {
    belief::Scene scene = *table_scene({box_model("box", {0.06, 0.06, 0.1})}, {at(0.3)}, 0.001, 0.001);
    belief::KinematicBody hand;
    hand.name = "hand";
    hand.timeline = {{0.0, at(0.4)}};
    scene.robot.push_back(hand);
    scene.objects[0].held_by = "hand";
    belief_.scene = std::make_shared<const belief::Scene>(scene);
    belief_.robot = {at(0.4)};
    belief::ObjectBelief object;
    object.name = "box";
    object.particles.resize(4);
    for (belief::Particle& particle : object.particles) {
      particle.log_weight = -std::log(4.0);
      particle.X_WO = at(0.3);
      particle.covariance.diagonal().head<6>().setConstant(1e-6);
      particle.mode = MotionMode::kHeld;
    }
    belief_.objects = {object};
  }

  static Pose at(double height) { return Pose::from_translation({0.0, 0.0, height}); }

  int frame(double fallen) {
    belief_.robot[0].translation.z() += 0.01;
    for (belief::Particle& particle : belief_.objects[0].particles)
      particle.X_WO.translation.z() = belief_.robot[0].translation.z() - 0.1 - fallen;
    return filter::infer_releases({}, belief_);
  }

  belief::Belief belief_;
};

TEST_F(InferRelease, NothingIsLetGoOfThatStaysInTheHand) {
  for (int i = 0; i < 100; ++i) EXPECT_EQ(frame(0.0005 * (i % 3)), 0) << i;
  EXPECT_EQ(belief_.scene->objects[0].held_by, "hand");
}

TEST_F(InferRelease, WhatLeftTheHandMayMoveAtAnySpeed) {
  for (int i = 0; i < 10; ++i) ASSERT_EQ(frame(0.0), 0);
  int released = 0;
  for (int i = 1; i <= 6 && released == 0; ++i) released = frame(0.03 * i);
  EXPECT_EQ(released, 1);
  EXPECT_FALSE(belief_.scene->objects[0].held_by);
  for (const belief::Particle& particle : belief_.objects[0].particles) {
    EXPECT_EQ(particle.mode, MotionMode::kMoving);
    EXPECT_GT(particle.covariance(9, 9), 0.0) << "the speed of a hand is not that of what it let go of";
  }
}

}  // namespace
}  // namespace prescene::filter_tests
