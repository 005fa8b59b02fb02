// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/weight.h"

#include <gtest/gtest.h>

#include <cmath>

#include "filter_fixture.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/matchers.h"

namespace prescene::filter_tests {
namespace {

using belief::Particle;

double position_variance(const Particle& particle) { return particle.covariance.diagonal().segment<3>(3).sum(); }

TEST(InformationInWorld, IsTheSameQuadraticForm) {
  core::RandomStream stream(3, core::Purpose::kTest);
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root.data()[i] = stream.normal();
  const Matrix6d H_C = root * root.transpose();
  const geometry::Quaterniond R_CW = geometry::uniform_rotation(stream);
  Vector6d d_W;
  for (int i = 0; i < 6; ++i) d_W[i] = stream.normal();
  Vector6d d_C = d_W;
  d_C.tail<3>() = R_CW * d_W.tail<3>();
  EXPECT_NEAR(d_W.dot(information_in_world(H_C, R_CW) * d_W), d_C.dot(H_C * d_C), 1e-9 * d_C.dot(H_C * d_C));
}

class WeightOfABox : public ::testing::Test {
 protected:
  WeightOfABox() : X_WO_{Pose{geometry::exp_rotation({0.0, 0.0, 0.4}), {0.02, -0.03, 0.09}}} {}

  void see(const std::vector<Occluder>& occluders) {
    sequence_ = still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {X_WO_});
    sequence_.occluders = occluders;
    frame_ = backends_.frame_of(sequence_.scene, sequence_.observe(30, *backends_.renderer));
    target_ = target_of(sequence_.scene->models[0], frame_, backends_.tools);
  }
  std::vector<Particle> particles_at(const Pose& X_WO, int count = 8) const {
    return particles_about(X_WO, belief::MotionMode::kMoving, count, {}, {4, core::Purpose::kStartBelief});
  }
  WeightReport weigh(std::vector<Particle>& particles) {
    return weight(frame_.terms, target_, frame_.X_WC, 1.0 / 30.0, {}, backends_.tools, {5, core::Purpose::kProposal},
                  particles);
  }
  Occluder plate_in_front() const { return plate(test_camera_pose(), fixed(X_WO_), 0.12, 0.34, 0.34, 0.0, 10.0); }

  Backends backends_;
  Pose X_WO_;
  SimulatedSequence sequence_;
  FilterFrame frame_;
  SearchTarget target_;
};

TEST_F(WeightOfABox, MovesParticlesToThePoseAndNarrowsThem) {
  see({});
  Pose off = X_WO_;
  off.translation += Vector3d(0.008, -0.006, 0.0);
  std::vector<Particle> particles = particles_at(off);
  const double spread_before = position_variance(particles[0]);
  const WeightReport report = weigh(particles);
  const Particle& best = particles[static_cast<std::size_t>(report.heaviest)];
  EXPECT_LT((best.X_WO.translation - X_WO_.translation).norm(), 0.004);
  EXPECT_LT(position_variance(best), 0.5 * spread_before);
  EXPECT_GT(report.evidence_per_pixel, 3.0);
  EXPECT_GT(report.visible_share, 0.7);
  EXPECT_EQ(report.hidden_weight, 0.0);
  EXPECT_FALSE(report.all_impossible);
  double sum = 0.0;
  for (const Particle& particle : particles) sum += std::exp(particle.log_weight);
  EXPECT_NEAR(sum, 1.0, 1e-9);
  for (const Particle& particle : particles) {
    EXPECT_GT(geometry::symmetric_eigen(particle.covariance).values.minCoeff(), -1e-12);
  }
}

TEST_F(WeightOfABox, PrefersTheParticleThatIsRight) {
  see({});
  std::vector<Particle> particles = particles_at(X_WO_, 2);
  particles[1].X_WO = X_WO_;
  particles[1].X_WO.translation.x() += 0.08;
  weigh(particles);
  EXPECT_GT(particles[0].log_weight, particles[1].log_weight);
}

TEST_F(WeightOfABox, StaysHiddenBehindAPlateInPlaceOfMovingOntoIt) {
  see({plate_in_front()});
  std::vector<Particle> particles = particles_at(X_WO_);
  for (Particle& particle : particles) particle.covariance.diagonal().segment<3>(3).setConstant(0.05 * 0.05);
  const std::vector<Particle> before = particles;
  const WeightReport report = weigh(particles);
  EXPECT_GT(report.hidden_weight, 0.99);
  EXPECT_LT(report.visible_share, 0.05);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    EXPECT_EQ(particles[i].X_WO, before[i].X_WO);
    EXPECT_EQ(particles[i].covariance, before[i].covariance);
  }
}

TEST_F(WeightOfABox, AHiddenPoseInsideASupportWeighsLessThanOneBesideIt) {
  see({plate_in_front()});
  Pose sunk = X_WO_;
  sunk.translation.z() -= 0.08;  // in the table, and behind the plate as well
  std::vector<Particle> particles = particles_at(X_WO_, 1);
  particles.push_back(particles_at(sunk, 1).front());
  belief::normalize(particles);
  const WeightReport report =
      weight(frame_.terms, target_, frame_.X_WC, 1.0 / 30.0, {}, backends_.tools, {5, core::Purpose::kProposal},
             particles, {.supports = frame_.surfaces.get(), .was_unseen = true});
  EXPECT_GT(report.hidden_weight, 0.99);
  EXPECT_GT(std::exp(particles[0].log_weight), 0.99);
}

TEST_F(WeightOfABox, AHiddenPoseInsideTheRobotWeighsLessUnlessAHandHoldsIt) {
  see({plate_in_front()});
  SupportSurfaces solids = *frame_.surfaces, arm;
  arm.add(*target_.mesh, Pose::identity());
  solids.place(arm, X_WO_);
  for (const auto mode : {belief::MotionMode::kMoving, belief::MotionMode::kHeld}) {
    std::vector<Particle> particles = particles_at(X_WO_, 1);
    particles.front().mode = mode;
    const auto weight_of = [&](const SupportSurfaces* robot) {
      std::vector<Particle> two = particles;
      two.push_back(particles_at(X_WO_, 1).front());
      two.back().mode = belief::MotionMode::kHeld;
      belief::normalize(two);
      weight(frame_.terms, target_, frame_.X_WC, 1.0 / 30.0, {}, backends_.tools, {5, core::Purpose::kProposal}, two,
             {.supports = frame_.surfaces.get(), .solids = robot, .was_unseen = true});
      return std::exp(two[0].log_weight);
    };
    EXPECT_NEAR(weight_of(nullptr), 0.5, 1e-9);
    if (mode == belief::MotionMode::kHeld)
      EXPECT_NEAR(weight_of(&solids), 0.5, 1e-9);
    else
      EXPECT_LT(weight_of(&solids), 0.01);
  }
}

TEST_F(WeightOfABox, WhatWasHiddenStaysHiddenWhereNothingIsExplained) {
  see({plate_in_front()});
  std::vector<Particle> particles = particles_at(X_WO_);
  // Knowing well where it is makes moving cheap.
  for (Particle& particle : particles) particle.covariance.topLeftCorner<6, 6>() *= 1e-4;
  const WeightReport report =
      weight(frame_.terms, target_, frame_.X_WC, 1.0 / 30.0, {}, backends_.tools, {5, core::Purpose::kProposal},
             particles, {.supports = nullptr, .was_unseen = true});
  EXPECT_GT(report.hidden_weight, 0.99);
}

TEST_F(WeightOfABox, AMatchOnAPlateHasNoOutline) {
  see({plate_in_front()});
  // The box put with a face into the plate's surface, well inside the plate.
  const Pose X_CO = frame_.X_CW * X_WO_;
  const Vector3d p_CP = X_CO.translation * (X_CO.translation.z() - 0.12) / X_CO.translation.z();
  Pose on_plate = Pose::from_translation(p_CP + Vector3d(0.0, 0.0, 0.03 - 0.0025));
  on_plate.rotation = geometry::exp_rotation({0.0, 0.0, 0.1}) * geometry::exp_rotation({0.0, 1.5707963, 0.0});
  const geometry::DepthImage there = depth_of(target_, on_plate, frame_.terms.camera, *backends_.renderer);
  EXPECT_LT(outline_support(frame_.terms, there, WeightOptions().outline_step), 0.2);
  see({});
  const geometry::DepthImage here = depth_of(target_, X_CO, frame_.terms.camera, *backends_.renderer);
  EXPECT_GT(outline_support(frame_.terms, here, WeightOptions().outline_step), 0.9);
}

TEST_F(WeightOfABox, EndsWhereNothingReturnsBeyondIt) {
  see({});
  const geometry::DepthImage box = depth_of(target_, frame_.X_CW * X_WO_, frame_.terms.camera, *backends_.renderer);
  // All that is seen beside it are a few pixels at its own depth, as of a finger that touches it.
  rendering::FrameTerms terms = frame_.terms;
  int fingers = 0;
  for (int y = 0; y < box.height(); ++y)
    for (int x = 0; x < box.width(); ++x) {
      if (box(x, y) > 0.0F) continue;
      terms.depth(x, y) = 0.0F;
      if (x < 2 || fingers >= 3 || !(box(x - 2, y) > 0.0F)) continue;
      terms.depth(x, y) = box(x - 2, y);
      ++fingers;
    }
  ASSERT_EQ(fingers, 3);
  const double step = WeightOptions().outline_step;
  EXPECT_EQ(outline_support(terms, box, step), 0.0);
  EXPECT_GT(outline_support(terms, box, step, OutlineHoles::kMayEnd), 0.8);
  // Where it returns itself no more than what is beside it, holes say nothing.
  for (int y = 0; y < box.height(); ++y)
    for (int x = 0; x < box.width(); ++x)
      if (box(x, y) > 0.0F && (x + y) % 8 != 0) terms.depth(x, y) = 0.0F;
  EXPECT_LT(outline_support(terms, box, step, OutlineHoles::kMayEnd), 0.7);
}

// Where the world's origin lies must not matter.
TEST_F(WeightOfABox, WeightsDoNotDependOnTheWorldFrame) {
  see({});
  std::vector<Particle> particles = particles_at(X_WO_);
  std::vector<Particle> moved = particles;
  const Pose X_VW{geometry::exp_rotation({0.0, 0.0, 1.1}), {0.5, -0.25, 0.125}};
  belief::Matrix12d turn = belief::Matrix12d::Identity();
  for (int block : {3, 6, 9}) turn.block<3, 3>(block, block) = X_VW.rotation.toRotationMatrix();
  for (Particle& particle : moved) {
    particle.X_WO = X_VW * particle.X_WO;
    particle.covariance = turn * particle.covariance * turn.transpose();
  }
  WeightOptions options;
  options.start_spread = 0.0;  // random starts are drawn in world axes
  weight(frame_.terms, target_, frame_.X_WC, 0.033, options, backends_.tools, {5, core::Purpose::kProposal}, particles);
  weight(frame_.terms, target_, X_VW * frame_.X_WC, 0.033, options, backends_.tools, {5, core::Purpose::kProposal},
         moved);
  for (std::size_t i = 0; i < particles.size(); ++i) {
    EXPECT_NEAR(moved[i].log_weight, particles[i].log_weight, 0.02) << i;
    EXPECT_THAT(moved[i].X_WO, tests::is_near(X_VW * particles[i].X_WO, 1e-4, 1e-5)) << i;
  }
}

TEST(SupportedEvidence, IsWorthItsOutline) {
  rendering::PoseEvidence evidence;
  evidence.visible = 10;
  evidence.visible_log_ratio = 50.0;
  const WeightOptions options;
  EXPECT_EQ(supported_evidence(evidence, options.min_outline, options), 0.0);
  EXPECT_NEAR(supported_evidence(evidence, options.full_outline, options), 5.0, 1e-12);
  evidence.visible_log_ratio = -50.0;  // evidence against a pose needs no outline
  EXPECT_EQ(supported_evidence(evidence, 0.0, options), -5.0);
}

}  // namespace
}  // namespace prescene::filter_tests
