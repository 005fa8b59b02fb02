// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/belief.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "prescene/belief/alternative_poses.h"
#include "prescene/core/sobol.h"
#include "tests/belief/random_values.h"
#include "tests/support/laws.h"
#include "tests/support/matchers.h"

namespace prescene::belief {
namespace {

using core::Purpose;
using core::RandomStream;

TEST(Normalize, MakesWeightsSumToOneKeepingTheirRatios) {
  std::vector<Particle> particles(3);
  particles[0].log_weight = 700.0;
  particles[1].log_weight = 701.0;
  particles[2].log_weight = std::nan("");
  ASSERT_TRUE(normalize(particles));
  EXPECT_NEAR(std::exp(particles[0].log_weight) + std::exp(particles[1].log_weight), 1.0, 1e-12);
  EXPECT_NEAR(particles[1].log_weight - particles[0].log_weight, 1.0, 1e-12);
  EXPECT_EQ(std::exp(particles[2].log_weight), 0.0);
}

TEST(Normalize, SaysWhenNothingIsLeftAndMakesThemEqual) {
  std::vector<Particle> particles(4);
  for (Particle& particle : particles) particle.log_weight = -std::numeric_limits<double>::infinity();
  EXPECT_FALSE(normalize(particles));
  EXPECT_NEAR(effective_sample_size(particles), 4.0, 1e-12);
  std::vector<Particle> none;
  EXPECT_FALSE(normalize(none));
}

TEST(EffectiveSampleSizeLaws, LiesBetweenOneAndTheCount) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const ObjectBelief object = tests::random_object_belief(stream, "a");
    const double size = effective_sample_size(object.particles);
    RC_ASSERT(size >= 1.0 - 1e-9 && size <= static_cast<double>(object.particles.size()) + 1e-9);
  }));
}

// Draws of one object's belief, by a net.
std::vector<ObjectState> draws_of(const ObjectBelief& object, int count) {
  Belief belief;
  belief.scene = std::make_shared<const Scene>(tests::small_scene());
  belief.objects = {object};
  const BeliefSampler sampler(belief);
  const core::SobolNet net(std::max(1, sampler.dimensions()), 3);
  std::vector<double> u(static_cast<std::size_t>(net.dimensions()));
  std::vector<ObjectState> states;
  for (int i = 0; i < count; ++i) {
    net.point(static_cast<std::uint64_t>(i), u);
    states.push_back(sampler.draw(std::span(u).first(static_cast<std::size_t>(sampler.dimensions()))).objects[0]);
  }
  return states;
}

// A tight mixture, for which first order is exact enough to be compared with draws.
ObjectBelief tight_object(RandomStream& stream, double spread = 0.1) {
  ObjectBelief object = tests::random_object_belief(stream, "a");
  const Pose middle = object.particles[0].X_WO;
  for (Particle& particle : object.particles) {
    particle.X_WO = geometry::box_plus(middle, spread * geometry::box_minus(particle.X_WO, middle));
    particle.covariance *= 0.01;
  }
  return object;
}

TEST(EstimateLaws, MeanAndCovarianceAreThoseOfTheDraws) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    // All of it at one place and turn: the mean of several would be none of them, and is not published.
    const ObjectBelief object = tight_object(stream, 0.02);
    const ObjectEstimate got = estimate(object);
    constexpr int kDraws = 4096;
    Vector6d sum = Vector6d::Zero();
    Matrix6d squares = Matrix6d::Zero();
    for (const ObjectState& state : draws_of(object, kDraws)) {
      const Vector6d d = geometry::box_minus(state.X_WO, got.mean);
      sum += d;
      squares += d * d.transpose();
    }
    RC_ASSERT((sum / kDraws).cwiseAbs().maxCoeff() < 1e-3);
    const double scale = std::max(1e-3, got.covariance.diagonal().maxCoeff());
    RC_ASSERT((squares / kDraws - got.covariance).cwiseAbs().maxCoeff() < 0.1 * scale);
  }));
}

TEST(EstimateLaws, ConfidenceIsTheShareOfDrawsNearTheMean) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    ObjectBelief object = tight_object(stream);
    object.state = TrackState::kTracked;
    const ObjectEstimate got = estimate(object);
    constexpr int kDraws = 4096;
    int near = 0;
    for (const ObjectState& state : draws_of(object, kDraws))
      near += (state.X_WO.translation - got.mean.translation).norm() <= 0.02 ? 1 : 0;
    RC_ASSERT(std::abs(got.confidence - object.existence * near / kDraws) < 0.05);
    object.state = TrackState::kLost;
    RC_ASSERT(estimate(object).confidence == 0.0);
  }));
}

TEST(EstimateLaws, TurningTheWorldTurnsTheEstimate) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    const ObjectBelief object = tight_object(stream);
    ObjectBelief turned = object;
    const Pose X_VW = tests::random_pose(stream);
    const geometry::Matrix3d R = X_VW.rotation.toRotationMatrix();
    for (Particle& particle : turned.particles) {
      particle.X_WO = X_VW * particle.X_WO;
      Matrix12d to = Matrix12d::Identity();
      to.block<3, 3>(3, 3) = R;  // rotation errors are in the body's frame and don't turn
      particle.covariance = (to * particle.covariance * to.transpose()).eval();
    }
    const ObjectEstimate a = estimate(object), b = estimate(turned);
    RC_ASSERT(geometry::box_minus(b.mean, X_VW * a.mean).norm() < 1e-9);
    Matrix6d to = Matrix6d::Identity();
    to.bottomRightCorner<3, 3>() = R;
    RC_ASSERT((b.covariance - to * a.covariance * to.transpose()).norm() < 1e-9);
    RC_ASSERT(std::abs(a.confidence - b.confidence) < 1e-9);
  }));
}

TEST(Estimate, OfParticlesOnBothSidesOfHalfATurnIsBetweenThem) {
  ObjectBelief object;
  for (const double angle : {3.1, -3.1}) {
    Particle particle;
    particle.X_WO.rotation = geometry::exp_rotation({0.0, 0.0, angle});
    particle.log_weight = std::log(0.5);
    object.particles.push_back(particle);
  }
  const Pose expected{geometry::exp_rotation({0.0, 0.0, 3.14159265358979}), Vector3d::Zero()};
  EXPECT_THAT(estimate(object).mean, tests::is_near(expected, 1e-6, 1e-12));
}

ObjectBelief turned_particles(const std::vector<double>& angles) {
  ObjectBelief object;
  for (const double angle : angles) {
    Particle particle;
    particle.X_WO.rotation = geometry::exp_rotation({0.0, 0.0, angle});
    particle.log_weight = -std::log(static_cast<double>(angles.size()));
    particle.covariance.diagonal().setConstant(1e-6);
    object.particles.push_back(particle);
  }
  return object;
}

TEST(Estimate, IsNotSureOfAnObjectThatMayBeTurned) {
  EXPECT_GT(estimate(turned_particles({0.0, 0.02, -0.02})).confidence, 0.99);
  // Half of the weight is half a turn away: what is published is one of the two, not their mean.
  EXPECT_NEAR(estimate(turned_particles({0.0, 3.0})).confidence, 0.5, 0.01);
  EXPECT_NEAR(estimate(turned_particles({0.0, 0.0, 0.0, 1.0})).confidence, 0.75, 0.03);
}

/// Of six particles three stand here, two are turned by half a turn about z, one is 30 cm away.
ObjectBelief three_groups() {
  ObjectBelief object;
  const std::array<double, 6> weights = {0.3, 0.2, 0.1, 0.15, 0.1, 0.15};
  object.particles.resize(weights.size());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    Particle& particle = object.particles[i];
    particle.log_weight = std::log(weights[i]);
    particle.X_WO.translation = {i == 5 ? 0.3 : 0.001 * static_cast<double>(i), 0.0, 0.0};
    if (i == 3 || i == 4) particle.X_WO.rotation = geometry::exp_rotation({0.0, 0.0, M_PI});
  }
  return object;
}

TEST(AlternativePoses, AreTheOtherGroupsWithTheirShares) {
  ObjectBelief object = three_groups();
  object.existence = 0.9;
  const auto alternatives = alternative_poses(object, geometry::SymmetryGroup::none());
  ASSERT_EQ(alternatives.size(), 2U);
  EXPECT_NEAR(alternatives[0].probability, 0.9 * 0.25, 1e-12);
  EXPECT_NEAR(alternatives[0].X_WO.translation.x(), (0.15 * 0.003 + 0.1 * 0.004) / 0.25, 1e-9);
  EXPECT_NEAR(alternatives[1].probability, 0.9 * 0.15, 1e-12);
  EXPECT_NEAR(alternatives[1].X_WO.translation.x(), 0.3, 1e-12);
  // What looks alike is no alternative.
  const auto symmetry = geometry::SymmetryGroup::continuous(Vector3d::UnitZ(), false);
  ASSERT_EQ(alternative_poses(object, symmetry).size(), 1U);
  EXPECT_NEAR(alternative_poses(object, symmetry)[0].X_WO.translation.x(), 0.3, 1e-12);
}

TEST(AlternativePoses, OfWhatIsLostOrSureAreNone) {
  ObjectBelief object = three_groups();
  object.state = TrackState::kLost;
  EXPECT_TRUE(alternative_poses(object, geometry::SymmetryGroup::none()).empty());
  object.state = TrackState::kTracked;
  object.particles.resize(3);
  normalize(object.particles);
  EXPECT_TRUE(alternative_poses(object, geometry::SymmetryGroup::none()).empty());
}

TEST(AlternativePosesLaws, AreFewApartFromEachOtherAndShareWhatTheEstimateLeaves) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    RandomStream stream(seed, Purpose::kTest);
    ObjectBelief object = tests::random_object_belief(stream, "a");
    object.state = TrackState::kTracked;
    const auto none = geometry::SymmetryGroup::none();
    const auto alternatives = alternative_poses(object, none);
    RC_ASSERT(alternatives.size() <= kMostAlternatives);
    double sum = 0.0, last = 1.0;
    for (const AlternativePose& other : alternatives) {
      RC_ASSERT(other.probability >= 0.01 && other.probability <= last);
      last = other.probability;
      sum += other.probability;
    }
    RC_ASSERT(sum <= object.existence + 1e-9);
  }));
}

TEST(Estimate, TakesPosesThatLookAlikeForOne) {
  using geometry::SymmetryGroup;
  const ObjectBelief quarter = turned_particles({0.01, 1.5707963 - 0.01});
  EXPECT_GT(estimate(quarter, SymmetryGroup::cube()).confidence, 0.99);
  EXPECT_NEAR(estimate(quarter, SymmetryGroup::cuboid()).confidence, 0.5, 0.01);
  const ObjectBelief any = turned_particles({0.0, 1.0, 2.0, -2.5});
  const ObjectEstimate of_a_can = estimate(any, SymmetryGroup::continuous(Vector3d::UnitZ(), false));
  EXPECT_GT(of_a_can.confidence, 0.99);
  EXPECT_LT(of_a_can.covariance(2, 2), 1e-5);
  EXPECT_LT(estimate(any).confidence, 0.6);
}

TEST(DrawStart, ChoosesParticlesByWeightAndSpreadsThemByTheirCovariance) {
  ObjectBelief object;
  object.name = "a";
  for (const double weight : {0.25, 0.75}) {
    Particle particle;
    particle.log_weight = std::log(weight);
    particle.X_WO.translation.x() = weight;
    particle.covariance(3, 3) = 1e-4;
    object.particles.push_back(particle);
  }
  const std::vector<ObjectState> draws = draws_of(object, 1024);
  int heavy = 0;
  for (const ObjectState& state : draws) {
    const bool is_heavy = state.X_WO.translation.x() > 0.5;
    heavy += is_heavy ? 1 : 0;
    EXPECT_NEAR(state.X_WO.translation.x(), is_heavy ? 0.75 : 0.25, 0.05);
  }
  EXPECT_EQ(heavy, 768);
}

TEST(Heaviest, IsTheFirstOfTheLargestWeight) {
  std::vector<Particle> particles(4);
  for (std::size_t i = 0; i < particles.size(); ++i) particles[i].log_weight = i == 0 ? -3.0 : -1.0;
  EXPECT_EQ(&heaviest(particles), &particles[1]);
}

TEST(ContentHash, SeesASingleBit) {
  RandomStream stream(4, Purpose::kTest);
  Belief belief;
  belief.objects = {tests::random_object_belief(stream, "a")};
  const std::uint64_t before = content_hash(belief);
  EXPECT_EQ(content_hash(Belief(belief)), before);
  double& entry = belief.objects[0].particles.back().covariance(7, 3);
  entry = std::nextafter(entry, 1.0);
  EXPECT_NE(content_hash(belief), before);
}

}  // namespace
}  // namespace prescene::belief
