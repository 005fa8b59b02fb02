// SPDX-License-Identifier: Apache-2.0
// What the finer image says of turns, on frames with known truth, and how it is weighed against the scene's prior.
#include "prescene/filter/operators/turn_looks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "filter_fixture.h"
#include "mug_with_handle.h"
#include "prescene/filter/operators/rivals.h"
#include "prescene/filter/proposals/fine_frame.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter_tests {
namespace {

using belief::MotionMode;
using belief::ObjectBelief;
using belief::Particle;
using geometry::SymmetryGroup;

constexpr int kParticles = 16;

belief::SceneObject turned_by(const Pose& X_WO, double sd_deg) {
  belief::SceneObject object;
  belief::NormalPose pose;
  pose.mean = X_WO;
  pose.covariance(2, 2) = std::pow(sd_deg * geometry::kDegree, 2);
  object.pose = pose;
  return object;
}

Pose turned(const Pose& X_WO, const Vector3d& by_deg) {
  return {X_WO.rotation * geometry::exp_rotation(geometry::kDegree * by_deg), X_WO.translation};
}

TEST(TurnPrior, IsThatOfANormalDistribution) {
  const Pose mean = mug_pose(0.4);
  const belief::SceneObject object = turned_by(mean, 15.0);
  EXPECT_EQ(TurnPrior(object, {}).log(mean), 0.0);
  // The scene's 15 degrees and the one that no scene is exact to.
  EXPECT_NEAR(TurnPrior(object, {}).log(turned(mean, {0.0, 0.0, 20.0})), -0.5 * 400.0 / (225.0 + 1.0), 0.01);
  EXPECT_EQ(TurnPrior(object, {}).log(turned(mean, {0.0, 0.0, 120.0})), kSlipLogOdds);
  EXPECT_EQ(TurnPrior(object, {}).log(turned(mean, {30.0, 0.0, 0.0})), kSlipLogOdds);
}

TEST(TurnPrior, CountsTurnsThatLookAlikeAsOne) {
  const Pose mean = mug_pose(0.4);
  const belief::SceneObject object = turned_by(mean, 15.0);
  const Pose upside_down = turned(mean, {180.0, 0.0, 0.0});
  EXPECT_NEAR(TurnPrior(object, SymmetryGroup::cyclic(Vector3d::UnitX(), 2)).log(upside_down), 0.0, 1e-9);
  EXPECT_EQ(TurnPrior(object, {}).log(upside_down), kSlipLogOdds);
}

TEST(TurnPrior, SaysNothingOfWhatIsLookedFor) {
  const Pose mean = mug_pose(0.4);
  EXPECT_EQ(TurnPrior(turned_by(mean, 90.0), {}).log(turned(mean, {0.0, 0.0, 170.0})), 0.0);
}

/// Looks at frames of a mug whose handle is turned by `truth`, from particles that all hold `held`, with a prior about
/// `held`.
struct Looks {
  Looks(double truth, double held, double sd_deg, int frames, double later_gain = 0.25) {
    Backends backends;
    SimulatedSequence sequence = still_sequence({mug_with_handle()}, {mug_pose(truth)});
    symmetry = sequence.scene->models[0].symmetry;
    const TurnPrior prior(turned_by(mug_pose(held), sd_deg), symmetry);
    core::RandomStream stream(1, core::Purpose::kStartBelief);
    object.particles = particles_about(mug_pose(held), MotionMode::kResting, kParticles, {}, stream);
    for (int number = 0; number < frames; ++number) {
      const belief::Observation observation = sequence.observe(number, *backends.renderer);
      const FilterFrame frame = backends.frame_of(sequence.scene, observation);
      const FineFrame fine = fine_frame(frame, *sequence.scene, observation, backends.tools);
      const SearchTarget target = target_of(sequence.scene->models[0], frame, backends.tools);
      const SearchTarget fine_target = in_fine(target, sequence.scene->models[0], backends.tools);
      const TurnLook look{frame, frame.terms, target, fine.terms, fine_target, prior, number == 0 ? 1.0 : later_gain};
      likely = look_at_turns(look, symmetry, {}, {}, backends.tools, object);
    }
  }

  /// Of turns within so many degrees of an angle.
  double probability_about(double angle, double degrees) const {
    double sum = 0.0;
    for (const Particle& particle : object.particles)
      if (geometry::symmetric_angle(particle.X_WO, mug_pose(angle), symmetry) < degrees * geometry::kDegree)
        sum += std::exp(particle.log_weight);
    return sum;
  }

  ObjectBelief object;
  SymmetryGroup symmetry;
  int likely = 0;
};

TEST(LookAtTurns, FindsAHandleThatIsSeenWhereverItWasHeldToBe) {
  for (const double side : {-0.5, 0.4}) {
    const double truth = angle_behind() + side * std::numbers::pi;
    for (const double off : {0.6, 1.5, -2.5}) {
      const Looks looks(truth, truth + off, 90.0, 1);
      EXPECT_GT(looks.probability_about(truth, 10.0), 0.9) << side << " " << off;
      EXPECT_EQ(looks.object.particles.size(), static_cast<std::size_t>(kParticles));
    }
  }
}

TEST(LookAtTurns, DoesNotDecideWhatNoImageShows) {
  const Looks looks(angle_behind(), angle_behind(), 90.0, 8);
  EXPECT_GE(looks.likely, 2);
  EXPECT_GT(looks.probability_about(angle_behind(), 60.0), 0.85);
  EXPECT_LT(looks.probability_about(angle_behind(), 12.0), 0.9);
}

TEST(LookAtTurns, KeepsATurnThatIsKnown) {
  const Looks looks(angle_behind(), angle_behind(), 3.0, 8);
  EXPECT_GT(looks.probability_about(angle_behind(), 15.0), 0.95);
}

/// In how many of eight frames a look moves a mug that rests where it is held to be, with its handle behind it, if this
/// is known to so many degrees and millimetres.
int moved_by_looks(double degrees, double millimetres, double gain) {
  Backends backends;
  const Pose X_WO = mug_pose(angle_behind());
  const SimulatedSequence sequence = still_sequence({mug_with_handle()}, {X_WO});
  const SymmetryGroup symmetry = sequence.scene->models[0].symmetry;
  const TurnPrior prior(turned_by(X_WO, 3.0), symmetry);
  Particle known;
  known.X_WO = X_WO;
  known.mode = MotionMode::kResting;
  known.log_weight = -std::log(static_cast<double>(kParticles));
  known.covariance.diagonal().head<3>().setConstant(std::pow(degrees * geometry::kDegree, 2));
  known.covariance.diagonal().segment<3>(3).setConstant(std::pow(1e-3 * millimetres, 2));
  int moved = 0;
  for (int number = 0; number < 8; ++number) {
    const belief::Observation observation = sequence.observe(number, *backends.renderer);
    const FilterFrame frame = backends.frame_of(sequence.scene, observation);
    const FineFrame fine = fine_frame(frame, *sequence.scene, observation, backends.tools);
    const SearchTarget target = target_of(sequence.scene->models[0], frame, backends.tools);
    const SearchTarget fine_target = in_fine(target, sequence.scene->models[0], backends.tools);
    ObjectBelief object;
    object.particles.assign(kParticles, known);
    look_at_turns({frame, frame.terms, target, fine.terms, fine_target, prior, gain}, symmetry, {}, {}, backends.tools,
                  object);
    moved += geometry::box_minus(belief::heaviest(object.particles).X_WO, X_WO).norm() > 1e-9 ? 1 : 0;
  }
  return moved;
}

// The noise of one frame is no reason to turn what many frames have shown: a handle that nothing shows has no turn that
// fits best but by chance.
TEST(LookAtTurns, AFrameMovesNothingThatEarlierFramesKnowBetter) {
  EXPECT_EQ(moved_by_looks(0.5, 0.1, 0.25), 0);
  // What is known of it is of no account where nothing is known, or where this look is the first.
  EXPECT_GT(moved_by_looks(60.0, 100.0, 0.25), 0);
  EXPECT_GT(moved_by_looks(0.5, 0.1, 1.0), 0);
}

TEST(LookAtTurns, FollowsTheFramesWhereTheSceneIsWrong) {
  const double truth = angle_behind() + 0.5 * std::numbers::pi;
  const Looks looks(truth, truth + 1.5, 3.0, 4);
  EXPECT_GT(looks.probability_about(truth, 10.0), 0.9);
}

TEST(LookAtTurns, WeighsALookByItsGain) {
  Backends backends;
  const double truth = angle_behind() + 0.5 * std::numbers::pi;
  // Two turns are held from the first look on: the wrong one keeps nearly its odds where a look hardly counts.
  const Looks one(truth, truth + 1.5, 90.0, 1), two(truth, truth + 1.5, 90.0, 2, 1e-6);
  EXPECT_NEAR(one.probability_about(truth, 15.0), two.probability_about(truth, 15.0), 0.02);
}

// What the frames come to know better did not move, and nothing is learned from it.
TEST(LookAtTurns, AreNoMotionToLearnFrom) {
  const double truth = angle_behind() + 0.25 * std::numbers::pi;
  Backends backends;
  SimulatedSequence sequence = still_sequence({mug_with_handle()}, {mug_pose(truth)});
  sequence.scene = open_scene({mug_with_handle()});
  for (const std::uint64_t seed : {1u, 2u}) {
    ParticleFilter filter = backends.make_filter();
    belief::Belief belief = filter.start(sequence.scene, seed);
    for (int number = 0; number < 40; ++number) {
      belief = filter.step(belief, sequence.observe(number, *backends.renderer), {}).belief;
      const auto& episode = belief.objects[0].motion.episode;
      EXPECT_FALSE(episode && episode->kind == belief::EpisodeKind::kMotion) << seed << ", frame " << number;
    }
  }
}

TEST(LookAtTurns, LeavesABallAlone) {
  Backends backends;
  const SimulatedSequence sequence = still_sequence({mug_with_handle()}, {mug_pose(0.0)});
  const belief::Observation observation = sequence.observe(0, *backends.renderer);
  const FilterFrame frame = backends.frame_of(sequence.scene, observation);
  const SearchTarget target = target_of(sequence.scene->models[0], frame, backends.tools);
  ObjectBelief object;
  core::RandomStream stream(1, core::Purpose::kStartBelief);
  object.particles = particles_about(mug_pose(0.3), MotionMode::kResting, kParticles, {}, stream);
  const std::vector<Particle> before = object.particles;
  const TurnPrior prior(turned_by(mug_pose(0.3), 90.0), {});
  const TurnLook look{frame, frame.terms, target, frame.terms, target, prior};
  EXPECT_EQ(look_at_turns(look, SymmetryGroup::every_rotation(), {}, {}, backends.tools, object), 1);
  EXPECT_EQ(object.particles, before);
}

}  // namespace
}  // namespace prescene::filter_tests
