// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/initialise.h"

#include <gtest/gtest.h>

#include <cmath>

#include "filter_fixture.h"

namespace prescene::filter_tests {
namespace {

TEST(BeliefFromPriors, DrawsTheScenesDistributions) {
  const auto scene =
      table_scene({box_model("box", {0.06, 0.10, 0.18})}, {Pose::from_translation({0.1, 0.2, 0.09})}, 0.02, 0.1);
  InitialiseOptions options;
  options.particles = 400;
  const belief::Belief belief = belief_from_priors(scene, 5, 17, options);
  ASSERT_EQ(belief.objects.size(), 1u);
  EXPECT_EQ(belief.step, 0u);
  EXPECT_EQ(belief.stamp_ns, 17);
  const auto& particles = belief.objects[0].particles;
  EXPECT_EQ(particles[0].X_WO.translation, Vector3d(0.1, 0.2, 0.09));
  double mean = 0.0, squares = 0.0;
  for (const auto& particle : particles) {
    mean += particle.X_WO.translation.x() / 400.0;
    squares += std::pow(particle.X_WO.translation.x() - 0.1, 2) / 400.0;
  }
  EXPECT_NEAR(mean, 0.1, 5.0 * 0.02 / 20.0);
  EXPECT_NEAR(squares / (0.02 * 0.02), 1.0, 5.0 * std::sqrt(2.0 / 400.0));
  EXPECT_EQ(belief_from_priors(scene, 5, 17, options), belief);
  EXPECT_FALSE(belief_from_priors(scene, 6, 17, options) == belief);
}

TEST(HasWidePrior, TellsPlacedObjectsFromOpenOnes) {
  const auto placed = table_scene({box_model("box", {0.1, 0.1, 0.1})}, {Pose::identity()}, 0.02, 0.1);
  const auto turned = table_scene({box_model("box", {0.1, 0.1, 0.1})}, {Pose::identity()}, 0.02, 1.0);
  const auto open = open_scene({box_model("box", {0.1, 0.1, 0.1})});
  EXPECT_FALSE(has_wide_prior(placed->objects[0]));
  EXPECT_TRUE(has_wide_prior(turned->objects[0]));
  EXPECT_TRUE(has_wide_prior(open->objects[0]));
}

class OpenTable : public ::testing::Test {
 protected:
  OpenTable() {
    models_ = {carton_model("carton"), box_model("box", {0.06, 0.10, 0.18}), can_model("can", 0.035, 0.11)};
    poses_ = {Pose{geometry::exp_rotation({0.0, 0.0, 0.5}), {-0.08, -0.15, 0.11}},
              Pose{geometry::exp_rotation({0.0, 0.0, -0.3}), {0.05, 0.02, 0.09}},
              Pose{geometry::exp_rotation({1.5707963, 0.0, 0.0}), {-0.05, 0.17, 0.035}}};
    sequence_ = still_sequence(models_, poses_);
    observation_ = sequence_.observe(0, *backends_.renderer);
  }
  std::vector<belief::ObjectModel> models_;
  std::vector<Pose> poses_;
  Backends backends_;
  SimulatedSequence sequence_;
  belief::Observation observation_;
};

TEST_F(OpenTable, FindsWhatTheSceneLeavesOpenInTheFirstFrame) {
  const auto scene = open_scene(models_);
  const FilterFrame frame = backends_.frame_of(scene, observation_);
  belief::Belief belief = belief_from_priors(scene, 1, 0, {});
  const FindReport report =
      find_in_frame(frame, observation_, {}, backends_.tools, {1, core::Purpose::kDetection}, belief);
  EXPECT_EQ(report.looked_for, 3);
  EXPECT_EQ(report.found, 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const belief::ObjectEstimate estimate = belief::estimate(belief.objects[i]);
    EXPECT_LT((estimate.mode.translation - poses_[i].translation).norm(), 0.02) << belief.objects[i].name;
    EXPECT_EQ(belief.objects[i].state, belief::TrackState::kTracked);
  }
}

TEST_F(OpenTable, WhatIsNotThereIsLostAndDoesNotPassForAnother) {
  std::vector<belief::ObjectModel> models = models_;
  models.push_back(box_model("brick", {0.20, 0.20, 0.25}));
  const auto scene = open_scene(models);
  const FilterFrame frame = backends_.frame_of(scene, observation_);
  belief::Belief belief = belief_from_priors(scene, 1, 0, {});
  const FindReport report =
      find_in_frame(frame, observation_, {}, backends_.tools, {1, core::Purpose::kDetection}, belief);
  EXPECT_EQ(report.looked_for, 4);
  EXPECT_EQ(report.found, 3);
  EXPECT_EQ(belief.objects[3].state, belief::TrackState::kLost);
  EXPECT_LT(belief.objects[3].existence, 0.5);
  EXPECT_FALSE(belief.objects[3].particles.empty());
}

TEST_F(OpenTable, ObjectsThatAreKnownAreNotFoundTwice) {
  // The box's place is known, so the other box of its kind has to be looked for elsewhere and is not there.
  auto scene = std::make_shared<belief::Scene>(*open_scene({models_[1]}));
  belief::SceneObject known = scene->objects[0];
  known.name = "known";
  known.pose = belief::FixedPose{poses_[1]};
  scene->objects.insert(scene->objects.begin(), known);
  const FilterFrame frame = backends_.frame_of(scene, observation_);
  belief::Belief belief = belief_from_priors(scene, 1, 0, {});
  find_in_frame(frame, observation_, {}, backends_.tools, {1, core::Purpose::kDetection}, belief);
  const Vector3d found = belief::estimate(belief.objects[1]).mode.translation;
  if (belief.objects[1].state != belief::TrackState::kLost) {
    EXPECT_GT((found - poses_[1].translation).norm(), 0.08);
  }
}

}  // namespace
}  // namespace prescene::filter_tests
