// SPDX-License-Identifier: Apache-2.0
// Answers about uncertain poses against a million drawn poses each, on packings small enough for all pairs.
#include "prescene/collision/spheres/uncertain_sphere_queries.h"

#include <gmock/gmock.h>

#include <hwy/highway.h>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/allocations.h"
#include "uncertain_settings.h"

namespace prescene::collision::uncertain_sphere_queries_test {
namespace {

TEST(UncertainSphereQueries, BoundsHoldAndMomentsAgreeWithDraws) {
  UncertainScratch scratch;
  for (const Setting& setting : settings()) {
    SCOPED_TRACE(setting.name);
    const auto between = RelativeUncertainty::make(setting.pose_a, setting.pose_b);
    ASSERT_TRUE(between.ok()) << between.status().message();
    const auto a = tree_of(setting.a);
    const auto b = tree_of(setting.b, 16);
    const UncertainOverlap overlap = uncertain_overlap(*a, *b, *between, scratch);
    const UncertainWrench wrench = uncertain_wrench(*a, *b, *between, {.stiffness = kStiffness}, scratch);
    const Sampled drawn = sample(setting);
    Vector6d mean;
    mean << wrench.force, wrench.torque;
    const double deviation = std::sqrt(drawn.covariance.topLeftCorner<3, 3>().trace()) + 1e-9;
    const double mean_off = (mean - drawn.mean).head<3>().norm() / deviation;
    const double covariance_off = (wrench.covariance - drawn.covariance).norm() / (drawn.covariance.norm() + 1e-9);
    std::printf("%-26s drawn %.4f in [%.4f, %.4f], estimate %.4f +- %.4f; mean %.3f deviations off, covariance %.3f\n",
                setting.name.c_str(), drawn.touching, overlap.lower, overlap.upper, overlap.probability,
                overlap.probability_error, mean_off, covariance_off);
    EXPECT_EQ(overlap.state, setting.state);
    EXPECT_EQ(overlap_state(*a, *b, *between, scratch), setting.state);
    EXPECT_LE(overlap.lower, drawn.touching + drawn.noise);
    EXPECT_GE(overlap.upper, drawn.touching - drawn.noise);
    EXPECT_LE(overlap.lower, overlap.probability);
    EXPECT_GE(overlap.upper, overlap.probability);
    EXPECT_NEAR(overlap.probability, drawn.touching, drawn.noise + overlap.probability_error + 0.01);
    if (setting.moments_off == 0.0) continue;
    EXPECT_LE(mean_off, 0.02);
    EXPECT_LE(covariance_off, setting.moments_off);
    EXPECT_NEAR(wrench.expected_pairs, drawn.pairs, 0.02 * drawn.pairs + 2.0 * drawn.noise);
  }
}

TEST(UncertainSphereQueries, PairsOfOneBodyAreNotIndependent) {
  // Two plates of spheres on each other: all pairs share the error of the pose, so their forces add up together. The
  // sum of their covariances, each on its own, is what they would give if they were independent.
  const std::vector<PackedSphere> below = grid(5, 5, 1, 0.01F);
  const std::vector<PackedSphere> above = grid(6, 6, 1, 0.01F);
  const UncertainPose fixed = {Pose::identity(), Matrix6d::Zero()};
  const UncertainPose placed = {Pose::from_translation({0.0, 0.0, 0.011}),
                                diagonal(Vector3d::Zero(), Vector3d::Constant(5e-4))};
  const auto between = *RelativeUncertainty::make(fixed, placed);
  UncertainScratch scratch;
  const PenaltyOptions options = {.stiffness = kStiffness};
  const Matrix6d together = uncertain_wrench(*tree_of(below), *tree_of(above), between, options, scratch).covariance;
  Matrix6d apart = Matrix6d::Zero();
  for (const PackedSphere& a : below)
    for (const PackedSphere& b : above)
      apart += uncertain_wrench(*tree_of({a}), *tree_of({b}), between, options, scratch).covariance;
  const Sampled drawn = sample({"plates", below, above, fixed, placed, OverlapState::kPossible, 0.0, 50'000});
  const auto deviation = [](const Matrix6d& covariance) { return std::sqrt(covariance(2, 2)); };
  EXPECT_NEAR(deviation(together), deviation(drawn.covariance), 0.15 * deviation(drawn.covariance));
  EXPECT_LT(deviation(apart), deviation(drawn.covariance) / 1.8);
}

void use_target(std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  hwy::GetChosenTarget().DeInit();
}

TEST(UncertainSphereQueries, EveryInstructionSetAnswersAlike) {
  UncertainScratch scratch;
  for (const Setting& setting : settings()) {
    SCOPED_TRACE(setting.name);
    const auto between = RelativeUncertainty::make(setting.pose_a, setting.pose_b);
    ASSERT_TRUE(between.ok());
    for (const int branching : {4, 8, 16}) {
      const auto a = tree_of(setting.a, branching);
      const auto b = tree_of(setting.b, branching);
      use_target(0);
      const UncertainOverlap overlap = uncertain_overlap(*a, *b, *between, scratch);
      const UncertainWrench wrench = uncertain_wrench(*a, *b, *between, {.stiffness = kStiffness}, scratch);
      for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        SCOPED_TRACE(hwy::TargetName(target));
        use_target(target);
        const UncertainOverlap again = uncertain_overlap(*a, *b, *between, scratch);
        EXPECT_EQ(again.state, overlap.state);
        EXPECT_EQ(overlap_state(*a, *b, *between, scratch), overlap.state);
        EXPECT_EQ(again.critical_pairs, overlap.critical_pairs);
        EXPECT_EQ(again.lower, overlap.lower);
        EXPECT_EQ(again.upper, overlap.upper);
        EXPECT_NEAR(again.probability, overlap.probability, 1e-4);
        const UncertainWrench other = uncertain_wrench(*a, *b, *between, {.stiffness = kStiffness}, scratch);
        EXPECT_LE((other.force - wrench.force).norm(), 1e-5 * wrench.force.norm() + 1e-7);
        EXPECT_LE((other.covariance - wrench.covariance).norm(), 1e-4 * wrench.covariance.norm() + 1e-9);
      }
    }
  }
  use_target(0);
}

TEST(UncertainSphereQueries, KnownPosesAnswerAsTheyAre) {
  UncertainScratch scratch;
  const auto a = tree_of(grid(3, 3, 3, 0.02F));
  const auto b = tree_of(grid(2, 2, 2, 0.02F));
  for (const double gap : {0.001, -0.002}) {
    const UncertainPose at = {Pose::from_translation({0.0, 0.0, 0.1 + gap}), Matrix6d::Zero()};
    const auto between = RelativeUncertainty::make({Pose::identity(), Matrix6d::Zero()}, at);
    ASSERT_TRUE(between.ok());
    const UncertainOverlap overlap = uncertain_overlap(*a, *b, *between, scratch);
    const UncertainWrench wrench = uncertain_wrench(*a, *b, *between, {}, scratch);
    // Each sphere of the lower layer rests between four of the upper one.
    const double distance = std::hypot(0.02 * std::sqrt(2.0), 0.04 + gap);
    const double depth = std::max(0.0, 0.04 - distance);
    EXPECT_EQ(overlap.state, depth > 0.0 ? OverlapState::kCertain : OverlapState::kNone);
    EXPECT_EQ(overlap_state(*a, *b, *between, scratch), overlap.state);
    EXPECT_NEAR(wrench.force.norm(), 4.0 * 4.0 * 0.5 * depth * (0.04 + gap) / distance, 1e-7);
    EXPECT_LE(wrench.covariance.norm(), 1e-12);
  }
}

// Described in a frame of A whose origin is P, the same contact has the torque about A's origin.
TEST(UncertainSphereQueries, WrenchIsAboutThePointAskedFor) {
  const Vector3d p_AP(0.03, -0.05, 0.02);
  std::vector<PackedSphere> spheres = grid(3, 3, 3, 0.02F);
  const auto a = tree_of(spheres);
  for (PackedSphere& sphere : spheres) sphere.centre -= p_AP.cast<float>();
  const auto moved_a = tree_of(spheres);
  const auto b = tree_of(grid(2, 2, 2, 0.02F));
  const UncertainPose at = {Pose::from_translation({0.004, 0.0, 0.08}), Matrix6d(1e-6 * Matrix6d::Identity())};
  UncertainPose moved_at = at;
  moved_at.X_WB.translation -= p_AP;
  const UncertainPose origin = {Pose::identity(), Matrix6d::Zero()};
  UncertainScratch scratch;
  const auto wrench =
      uncertain_wrench(*a, *b, *RelativeUncertainty::make(origin, at), {.stiffness = 100.0, .p_AP = p_AP}, scratch);
  const auto expected =
      uncertain_wrench(*moved_a, *b, *RelativeUncertainty::make(origin, moved_at), {.stiffness = 100.0}, scratch);
  EXPECT_GT(wrench.force.norm(), 0.1);
  EXPECT_LT((wrench.force - expected.force).norm(), 1e-3 * expected.force.norm());
  EXPECT_LT((wrench.torque - expected.torque).norm(), 1e-3 * expected.torque.norm() + 1e-5);
  EXPECT_LT((wrench.covariance - expected.covariance).norm(), 1e-3 * expected.covariance.norm());
}

/// Least distance along the line of centres in standard deviations, and by how much some pair is sure to touch, m.
struct AllPairs {
  double least_margin = std::numeric_limits<double>::infinity();
  double surest = -std::numeric_limits<double>::infinity();
};
AllPairs look_at_all(const std::vector<PackedSphere>& a, const std::vector<PackedSphere>& b,
                     const RelativeUncertainty& between) {
  AllPairs all;
  for (const PackedSphere& sphere_b : b) {
    const Vector3d p = (between.X_AB() * sphere_b.centre).cast<double>();
    const double arm = (p - between.pivot()).norm();
    for (const PackedSphere& sphere_a : a) {
      const Vector3d apart = p - sphere_a.centre.cast<double>();
      const double gap = apart.norm() - static_cast<double>(sphere_a.radius) - static_cast<double>(sphere_b.radius);
      const Vector3d n = apart.normalized();
      const double deviation = std::sqrt(n.dot(between.covariance_at(p) * n));
      all.least_margin = std::min(all.least_margin, (gap - between.remainder(arm)) / deviation);
      all.surest =
          std::max(all.surest, -gap - between.remainder(arm) - between.ball_radius() * between.deviation_bound(arm));
    }
  }
  return all;
}

TEST(UncertainSphereQueries, TheStateIsThatOfAllPairs) {
  RandomStream stream(7, core::Purpose::kTest);
  UncertainScratch scratch;
  const std::vector<PackedSphere> spheres_a = grid(5, 4, 3, 0.01F);
  const std::vector<PackedSphere> spheres_b = grid(3, 3, 4, 0.012F);
  const auto a = tree_of(spheres_a, 4);
  const auto b = tree_of(spheres_b, 4);
  std::array<int, 3> seen{};
  for (int i = 0; i < 3000; ++i) {
    const double scale = std::pow(10.0, stream.uniform(-4.0, -1.5));
    const double z = stream.normal(), y = stream.normal(), x = stream.normal();
    const Vector3d direction(x, y, z);
    const double turn_z = stream.normal(), turn_y = stream.normal(), turn_x = stream.normal(), turn_w = stream.normal();
    const geometry::Quaterniond turn(turn_w, turn_x, turn_y, turn_z);
    const Pose X_AB = {turn.normalized(), stream.uniform(0.0, 0.12) * direction.normalized()};
    const Matrix6d covariance = diagonal(Vector3d::Constant(10.0 * scale), Vector3d::Constant(scale));
    const auto between = RelativeUncertainty::make({Pose::identity(), covariance}, {X_AB, covariance});
    ASSERT_TRUE(between.ok());
    const OverlapState state = overlap_state(*a, *b, *between, scratch);
    ++seen[static_cast<std::size_t>(state)];
    const AllPairs all = look_at_all(spheres_a, spheres_b, *between);
    constexpr double kRounding = 1e-4;  // of margins, and of radii, m
    if (state == OverlapState::kNone) {
      EXPECT_GE(all.least_margin, between->region_radius() - kRounding);
    } else {
      // The kernels' bounds are tangents of those here, a little above them.
      EXPECT_LE(all.least_margin, 1.02 * between->region_radius());
    }
    if (state == OverlapState::kCertain) {
      EXPECT_GE(all.surest, -kRounding * 0.01);
    }
    const UncertainOverlap overlap = uncertain_overlap(*a, *b, *between, scratch);
    if (overlap.complete || overlap.state == OverlapState::kCertain) {
      EXPECT_EQ(state, overlap.state);
    }
  }
  EXPECT_THAT(seen, testing::Each(testing::Gt(150)));
}

TEST(UncertainSphereQueries, RefusesWhatIsNoCovariance) {
  const auto refusal = [](const Matrix6d& covariance, double confidence = 0.997) {
    const auto made =
        RelativeUncertainty::make({Pose::identity(), covariance}, {Pose::identity(), Matrix6d::Zero()}, confidence);
    EXPECT_FALSE(made.ok());
    return made.ok() ? std::string() : made.status().message();
  };
  Matrix6d covariance = Matrix6d::Identity();
  covariance(2, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(covariance), testing::HasSubstr("body A is not finite"));
  covariance(2, 3) = 0.5;
  EXPECT_THAT(refusal(covariance), testing::HasSubstr("not symmetric"));
  covariance(3, 2) = 0.5;
  covariance(4, 4) = -1.0;
  EXPECT_THAT(refusal(covariance), testing::HasSubstr("not positive semidefinite"));
  covariance(4, 4) = 1.0;
  covariance(2, 3) = covariance(3, 2) = 1.5;
  EXPECT_THAT(refusal(covariance), testing::HasSubstr("not positive semidefinite"));
  EXPECT_THAT(refusal(Matrix6d::Identity(), 1.0), testing::HasSubstr("confidence"));
  EXPECT_THAT(refusal(Matrix6d::Identity(), 0.2), testing::HasSubstr("confidence"));
}

TEST(UncertainSphereQueries, CovariancesOfAnySizeAreJoined) {
  core::RandomStream random(3, core::Purpose::kTest);
  for (int i = 0; i < 20'000; ++i) {
    UncertainPose poses[2];
    for (UncertainPose& pose : poses) {
      const geometry::Quaterniond rotation = geometry::uniform_rotation(random);
      const Vector3d towards = geometry::normal_vector(random);
      pose.X_WB = {rotation, random.uniform(0.0, 30.0) * towards};
      // A few directions of very different sizes.
      geometry::Matrix6d factor = geometry::Matrix6d::Zero();
      for (int k = 0; k < static_cast<int>(1 + random.uniform_below(4)); ++k) {
        const double size = std::pow(10.0, random.uniform(-7.0, 1.0));
        for (int row = 0; row < 6; ++row) factor(row, k) = size * random.normal();
      }
      pose.covariance = factor * factor.transpose();
    }
    const auto joined = RelativeUncertainty::make(poses[0], poses[1]);
    ASSERT_TRUE(joined.ok()) << i << ": " << joined.status().message();
    const geometry::Matrix6d again = joined->factor() * joined->factor().transpose();
    ASSERT_LT((again - joined->covariance()).norm(), 1e-6 * joined->covariance().norm()) << i;
  }
}

TEST(UncertainSphereQueries, FirstOrderAndRemainderBoundTheDisplacement) {
  RandomStream stream(11, core::Purpose::kTest);
  for (const Setting& setting : settings()) {
    SCOPED_TRACE(setting.name);
    const auto between = RelativeUncertainty::make(setting.pose_a, setting.pose_b);
    ASSERT_TRUE(between.ok());
    const Pose X_AB = setting.pose_a.X_WB.inverse() * setting.pose_b.X_WB;
    const Matrix6d L_A = factor_of(setting.pose_a.covariance);
    const Matrix6d L_B = factor_of(setting.pose_b.covariance);
    for (int i = 0; i < 2000; ++i) {
      const Vector6d d_A = L_A * normals(stream);
      const Vector6d d_B = L_B * normals(stream);
      const double z = stream.uniform(-0.1, 0.1), y = stream.uniform(-0.1, 0.1), x = stream.uniform(-0.1, 0.1);
      const Vector3d p_BQ(x, y, z);
      const Vector3d p = X_AB * p_BQ;
      const Pose X_AB_drawn = box_plus(setting.pose_a.X_WB, d_A).inverse() * box_plus(setting.pose_b.X_WB, d_B);
      const Vector3d moved = X_AB_drawn * p_BQ - p;
      // The same to first order, from the definition.
      const Matrix3d R_AW = setting.pose_a.X_WB.rotation.toRotationMatrix().transpose();
      const Vector3d phi_B = X_AB.rotation * Vector3d(d_B.head<3>());
      const Vector3d linear =
          R_AW * (d_B.tail<3>() - d_A.tail<3>()) + phi_B.cross(p - X_AB.translation) - Vector3d(d_A.head<3>()).cross(p);
      const double distance = (p - between->pivot()).norm();
      ASSERT_LE((moved - linear).norm(), between->remainder(distance));
      ASSERT_GE(between->deviation_bound(distance) * (1.0 + 1e-9), std::sqrt(between->covariance_at(p).trace() / 3.0));
    }
  }
}

TEST(UncertainSphereQueries, DoNotAllocateOnceWarm) {
  if (!tests::can_count_allocations()) GTEST_SKIP() << "allocations are not counted in this build";
  const Setting setting = settings().back();
  const auto between = RelativeUncertainty::make(setting.pose_a, setting.pose_b);
  ASSERT_TRUE(between.ok());
  const auto a = tree_of(setting.a);
  const auto b = tree_of(setting.b, 16);
  UncertainScratch scratch;
  uncertain_overlap(*a, *b, *between, scratch);
  overlap_state(*a, *b, *between, scratch);
  uncertain_wrench(*a, *b, *between, {.stiffness = kStiffness}, scratch);
  const auto before = tests::allocation_count();
  uncertain_overlap(*a, *b, *between, scratch);
  overlap_state(*a, *b, *between, scratch);
  uncertain_wrench(*a, *b, *between, {.stiffness = kStiffness}, scratch);
  EXPECT_EQ(tests::allocation_count(), before);
}

}  // namespace
}  // namespace prescene::collision::uncertain_sphere_queries_test
