// SPDX-License-Identifier: Apache-2.0
// What lies still: its pose comes to rest, costs little, and is left at once when it moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "filter_fixture.h"
#include "prescene/filter/operators/still_update.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/sampling.h"
#include "tests/filter/counting_likelihood.h"

namespace prescene::filter_tests {
namespace {

using belief::Belief;
using filter::still_update;
using filter::StillUpdate;

Matrix6d random_covariance(double scale, core::RandomStream& stream) {
  Matrix6d root;
  for (int i = 0; i < 36; ++i) root.data()[i] = stream.normal();
  return scale * (root * root.transpose() + 0.1 * Matrix6d::Identity());
}

Vector6d drawn_from(const Matrix6d& covariance, core::RandomStream& stream) {
  Vector6d z;
  for (int i = 0; i < 6; ++i) z[i] = stream.normal();
  return geometry::Cholesky6(covariance).factor() * z;
}

double log_normal(const Vector6d& d, const Matrix6d& covariance) {
  const geometry::Cholesky6 cholesky(covariance);
  return -0.5 * d.dot(cholesky.solve(d)) - cholesky.factor().diagonal().array().log().sum() -
         3.0 * std::log(2.0 * std::numbers::pi);
}

TEST(StillUpdate, WithoutCommonErrorsIsTheKalmanUpdate) {
  core::RandomStream stream(7, core::Purpose::kTest);
  for (int run = 0; run < 20; ++run) {
    const Matrix6d P = random_covariance(1e-4, stream), R = random_covariance(1e-5, stream);
    const Vector6d seen = drawn_from(P + R, stream);
    const Matrix6d H = geometry::Cholesky6(R).inverse();
    const StillUpdate update = still_update(P, H, H * seen, 0.0);
    const Matrix6d gain = P * geometry::Cholesky6(P + R).inverse();
    EXPECT_LT((update.shift - gain * seen).norm(), 1e-8 * seen.norm());
    EXPECT_LT((update.covariance - (P - gain * P)).norm(), 1e-8 * P.norm());
    EXPECT_NEAR(update.log_evidence, log_normal(seen, P + R) - log_normal(Vector6d::Zero(), R), 1e-6);
    const Vector6d left = seen - update.shift;
    EXPECT_NEAR(update.below_peak, 0.5 * left.dot(H * left), 1e-6);
  }
}

TEST(StillUpdate, InTheNthFrameTheGainIsOneOverN) {
  core::RandomStream stream(8, core::Purpose::kTest);
  const Matrix6d R = random_covariance(1e-5, stream), H = geometry::Cholesky6(R).inverse();
  Matrix6d P = 1e4 * R;
  for (int n = 1; n <= 50; ++n) {
    const StillUpdate update = still_update(P, H, Vector6d::Zero(), 0.4);
    EXPECT_NEAR(update.largest_gain, 1.0 / n, 1e-3);
    P = update.covariance;
    EXPECT_LT((P - (0.4 + 0.6 / n) * R).norm(), 2e-3 * R.norm()) << n;
  }
}

// The covariance is that of the errors there are, and the evidence that of the innovations.
TEST(StillUpdateStatistics, AreThoseOfErrorsOfWhichAShareIsCommon) {
  core::RandomStream stream(9, core::Purpose::kTest);
  const double common = 0.5;
  double distance = 0.0, last_steps = 0.0, first_steps = 0.0;
  constexpr int kRuns = 400, kFrames = 30;
  for (int run = 0; run < kRuns; ++run) {
    const Matrix6d R = random_covariance(1e-5, stream), H = geometry::Cholesky6(R).inverse();
    Matrix6d P = 100.0 * R;
    Vector6d mean = drawn_from(P, stream);  // of a truth at zero
    const Vector6d shared = drawn_from(common * R, stream);
    for (int n = 0; n < kFrames; ++n) {
      const Vector6d seen = shared + drawn_from((1.0 - common) * R, stream) - mean;
      const StillUpdate update = still_update(P, H, H * seen, common);
      mean += update.shift;
      P = update.covariance;
      const double step = update.shift.dot(H * update.shift);
      if (n > 0 && n <= 5) first_steps += step / (5.0 * kRuns);
      if (n >= kFrames - 5) last_steps += step / (5.0 * kRuns);
    }
    distance += mean.dot(geometry::Cholesky6(P).inverse() * mean) / kRuns;
  }
  // Mean of chi-squared with six degrees of freedom, within five standard errors.
  EXPECT_NEAR(distance, 6.0, 5.0 * std::sqrt(12.0 / kRuns));
  // Steps shrink as 1 / n^2: sums of 1 / (n (n - 1)) over the frames.
  EXPECT_NEAR(last_steps / first_steps, (1.0 / 25.0 - 1.0 / 30.0) / (1.0 - 1.0 / 6.0), 2e-3);
}

TEST(StillUpdate, WhatAFrameDoesNotTellStays) {
  const Matrix6d P = 1e-4 * Matrix6d::Identity();
  Matrix6d H = Matrix6d::Zero();
  H(3, 3) = 1e6;
  Vector6d g = Vector6d::Zero();
  g[3] = 1e3;
  const StillUpdate update = still_update(P, H, g, 0.5);
  EXPECT_GT(update.shift[3], 0.0009);
  EXPECT_EQ(update.shift[4], 0.0);
  EXPECT_NEAR(update.covariance(4, 4), 1e-4, 1e-12);
  EXPECT_LT(update.covariance(3, 3), 2e-6);
  // A frame that is worse than what all have in common.
  const StillUpdate poor = still_update(P, 1e2 * Matrix6d::Identity(), 10.0 * Vector6d::Ones(), 0.5);
  EXPECT_EQ(poor.shift, Vector6d::Zero());
  EXPECT_LT((poor.covariance - P).norm(), 1e-12);
}

/// A box whose motion begins after a second of rest; what is published of it.
struct Followed {
  std::vector<Pose> published;
  std::vector<belief::MotionMode> motion;
  std::vector<int> comparisons;  ///< Poses that each frame was compared with.
  int untracked = 0;             ///< Frames.
};
Followed follow(const Motion& motion, int frames, std::uint64_t seed) {
  Backends backends;
  belief::ObjectModel model = box_model("box", {0.06, 0.10, 0.18});
  model.symmetry = geometry::SymmetryGroup::cuboid();  // else its turns share the weight
  SimulatedSequence sequence = still_sequence({model}, {motion(0.0)});
  sequence.objects = {motion};
  sequence.seed = seed;
  const CountingLikelihood likelihood(*backends.likelihood);
  ParticleFilter filter(likelihood, *backends.renderer, backends.threads, {});
  Belief belief = filter.start(sequence.scene, seed);
  Followed followed;
  for (int frame = 0; frame < frames; ++frame) {
    StepResult result = filter.step(belief, sequence.observe(frame, *backends.renderer), {});
    belief = std::move(result.belief);
    const belief::ObjectEstimate estimate = belief::estimate(belief, belief.objects[0]);
    followed.published.push_back(estimate.mean);
    followed.motion.push_back(estimate.motion);
    followed.comparisons.push_back(likelihood.poses.exchange(0));
    followed.untracked += belief.objects[0].state != belief::TrackState::kTracked;
  }
  return followed;
}

Motion box_at_rest() { return fixed(Pose{geometry::exp_rotation({0.0, 0.0, 0.4}), {0.02, -0.03, 0.09}}); }

TEST(StillObject, ComesToRestAndCostsLittle) {
  const Followed box = follow(box_at_rest(), 40, 11);
  EXPECT_EQ(box.untracked, 0);
  double early = 0.0, late = 0.0;
  for (std::size_t i = 1; i < box.published.size(); ++i) {
    const Vector6d step = geometry::box_minus(box.published[i], box.published[i - 1]);
    if (i <= 6) early += step.squaredNorm() / 6.0;
    if (i >= 34) late += step.squaredNorm() / 6.0;
    if (i < 10) continue;
    EXPECT_LT(step.tail<3>().norm(), 1e-3) << i;
    EXPECT_LT(step.head<3>().norm(), 0.0052) << i;  // 0.3 degrees
  }
  EXPECT_LT(late, early / 9.0);
  // In most frames one pose stands for all particles, and those that wake follow from it. Each alone would be compared
  // with the frame six times or more.
  std::vector<int> comparisons(box.comparisons.begin() + 10, box.comparisons.end());
  std::nth_element(comparisons.begin(), comparisons.begin() + 15, comparisons.end());
  EXPECT_LE(comparisons[15], 6);
  EXPECT_EQ(box.motion.back(), belief::MotionMode::kResting);
}

// Along the table, or up from it.
TEST(StillObject, ASlowPushIsFollowed) {
  const Motion rest = box_at_rest();
  for (const Vector3d& direction : {Vector3d(1.0, 0.0, 0.0), Vector3d(0.0, 1.0, 0.0), Vector3d(0.0, 0.0, 1.0)}) {
    const auto pushed = [&](double time) {
      Pose X_WO = rest(time);
      X_WO.translation += std::max(0.0, time - 0.8) * 0.03 * direction;  // 1 mm in a frame
      return X_WO;
    };
    const Followed box = follow(pushed, 50, 12);
    EXPECT_LE(box.untracked, 1);
    double sum = 0.0;
    for (std::size_t i = 26; i < box.published.size(); ++i) {
      const double error = (box.published[i].translation - pushed(static_cast<double>(i) / 30.0).translation).norm();
      EXPECT_LT(error, 0.009) << i;
      sum += error;
    }
    EXPECT_LT(sum / static_cast<double>(box.published.size() - 26), 0.004);
  }
}

TEST(StillObject, ASmallDisplacementIsFoundWithinAFewFrames) {
  const Motion rest = box_at_rest();
  for (const Vector3d& shift : {Vector3d(0.005, 0.0, 0.0), Vector3d(0.0, 0.005, 0.0), Vector3d(0.0, -0.005, 0.0)}) {
    const auto moved = [&](double time) {
      Pose X_WO = rest(time);
      if (time > 0.8) X_WO.translation += shift;
      return X_WO;
    };
    const Followed box = follow(moved, 34, 13);
    EXPECT_EQ(box.untracked, 0);
    const Vector3d before = box.published[23].translation - rest(0.0).translation;
    for (std::size_t i = 24 + 5; i < box.published.size(); ++i)
      EXPECT_LT((box.published[i].translation - moved(1.0).translation - before).norm(), 0.0035) << i;
  }
}

}  // namespace
}  // namespace prescene::filter_tests
