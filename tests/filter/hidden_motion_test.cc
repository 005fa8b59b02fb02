// SPDX-License-Identifier: Apache-2.0
// What is out of sight while something that is known moves: laws, and simulated truths that the belief does not know.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "prescene/filter/operators/predict.h"
#include "tests/filter/pushed_box.h"

namespace prescene::filter_tests {
namespace {

using belief::MotionMode;
using belief::Particle;
using filter::MotionNoise;
using filter::predict;
using filter::PredictOptions;
using filter::RobotBounds;
using geometry::Vector3d;

constexpr double kStep30Hz = 1.0 / 30.0;
constexpr double kChiSquared90 = 6.2514;  // 3 degrees of freedom
constexpr double kHalfHeight = 0.03;      // m, of the box

/// The belief of a box that comes to rest, with a set of particles about it, and is then out of sight.
belief::Belief out_of_sight(belief::Belief belief) {
  belief::ObjectBelief& object = belief.objects[0];
  object.state = belief::TrackState::kUnseen;
  object.last_seen_ns = belief.stamp_ns;
  Particle particle = object.particles[0];
  particle.mode = MotionMode::kResting;
  particle.log_weight = -std::log(16.0);
  object.particles.assign(16, particle);
  return belief;
}

bool region_holds(const belief::Belief& belief, const Vector3d& p_W) {
  const belief::ObjectEstimate estimate = belief::estimate(belief, belief.objects[0]);
  const geometry::Matrix3d covariance = estimate.covariance.bottomRightCorner<3, 3>();
  const Vector3d d = p_W - estimate.mean.translation;
  return d.dot(covariance.llt().solve(d)) <= kChiSquared90;
}

class OutOfSight : public ::testing::Test {
 protected:
  void predict_to(const std::vector<belief::Belief>& truths, std::size_t first, std::size_t last,
                  belief::Belief& belief) {
    for (std::size_t frame = first + 1; frame <= last; ++frame) {
      belief.stamp_ns = truths[frame].stamp_ns;
      ++belief.step;
      predict(belief, {}, truths[frame].robot, kStep30Hz, {},
              {push_simulators(), bounds_, {belief.seed, core::Purpose::kProcessNoise}, threads_});
    }
  }
  RobotBounds bounds_;
  core::ThreadPool threads_{2};
};

TEST_F(OutOfSight, WhatABodyOfTheRobotPushesOnIsInTheRegionThatIsBelieved) {
  int held = 0, runs = 0;
  for (const double friction : {0.2, 0.4, 0.7})
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      Push push;
      push.friction = friction;
      push.aside = 0.005 * static_cast<double>(seed);
      const std::vector<belief::Belief> truths = tracked_push(push, seed, threads_);
      const std::size_t first = 15, last = truths.size() - 1;
      const Vector3d p_first = truths[first].objects[0].particles[0].X_WO.translation;
      const Vector3d p_last = truths[last].objects[0].particles[0].X_WO.translation;
      ASSERT_GT((p_last - p_first).norm(), 0.05);
      belief::Belief belief = out_of_sight(truths[first]);
      predict_to(truths, first, last, belief);
      held += region_holds(belief, p_last);
      ++runs;
      for (const Particle& particle : belief.objects[0].particles)
        EXPECT_GT(particle.X_WO.translation.z(), kHalfHeight - 0.01);  // it stands on the table
    }
  EXPECT_GE(held, runs - 3) << "of " << runs;  // 90 % of 12; 8 or fewer have a probability of half a percent
}

TEST_F(OutOfSight, WhatStandsWhereNothingComesStaysAndIsForgottenNoFaster) {
  Push push;
  push.speed = 0.0;
  const std::vector<belief::Belief> truths = tracked_push(push, 1, threads_);
  belief::Belief belief = out_of_sight(truths[0]);
  const std::vector<Particle> before = belief.objects[0].particles;
  predict_to(truths, 0, truths.size() - 1, belief);
  const double elapsed = kStep30Hz * static_cast<double>(truths.size() - 1);
  const MotionNoise noise = PredictOptions{}.resting;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Particle& particle = belief.objects[0].particles[i];
    EXPECT_EQ(particle.X_WO, before[i].X_WO);
    EXPECT_EQ(particle.mode, MotionMode::kResting);
    for (int k = 0; k < 6; ++k) {
      const double share = k < 3 ? noise.turn : noise.shift;
      EXPECT_NEAR(particle.covariance(k, k), before[i].covariance(k, k) + share * share * elapsed, 1e-12);
    }
  }
}

TEST_F(OutOfSight, APushOfAControlGoesOnUntilItsEnd) {
  Push push;
  push.speed = 0.0;  // the body of the robot stays where it is
  const std::vector<belief::Belief> truths = tracked_push(push, 1, threads_);
  belief::Belief belief = out_of_sight(truths[0]);
  belief::Push finger;
  finger.from = {0.0, -0.10, 0.03};
  finger.to = {0.0, 0.06, 0.03};  // its front then is 7.5 cm from the middle of where the box stood
  finger.duration = 0.5;
  belief::Control control;
  control.actions = {{0.5 * kStep30Hz, finger}};
  belief.robot = truths[0].robot;
  for (int frame = 1; frame <= 45; ++frame) {
    ++belief.step;
    predict(belief, control, truths[0].robot, kStep30Hz, {},
            {push_simulators(), bounds_, {2, core::Purpose::kProcessNoise}, threads_});
    control = {};
    const double left = 0.5 * kStep30Hz + finger.duration - frame * kStep30Hz;
    ASSERT_EQ(belief.pushes.size(), left > 0.0 ? 1u : 0u) << frame;
    if (left > 0.0) {
      EXPECT_NEAR(belief.pushes[0].time, 0.5 * kStep30Hz - frame * kStep30Hz, 1e-9);
    }
  }
  const belief::ObjectEstimate estimate = belief::estimate(belief, belief.objects[0]);
  // Half of the box is 4 cm: a ball of 1.5 cm that ends at 6 cm leaves its middle at 11.5 cm or beyond.
  EXPECT_GT(estimate.mean.translation.y(), 0.10);
  EXPECT_NEAR(estimate.mean.translation.x(), 0.0, 0.03);
  EXPECT_NEAR(estimate.mean.translation.z(), kHalfHeight, 0.01);
}

}  // namespace
}  // namespace prescene::filter_tests
