// SPDX-License-Identifier: Apache-2.0
// Poses that a frame cannot tell apart, or that it was wrong about: laws, and sequences with known truth.
#include "prescene/filter/operators/rivals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "filter_fixture.h"
#include "mug_with_handle.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter_tests {
namespace {

using belief::Belief;
using belief::MotionMode;
using belief::Particle;
using geometry::SymmetryGroup;

constexpr double kRightShift = 0.02;  // m
constexpr double kRightTurn = 0.2618;

struct TurnRun {
  int frames = 0;
  int tracked = 0;
  int wrong = 0;  ///< In state tracked.
  belief::ObjectEstimate last;
  bool last_right = false;
};

TurnRun turn_run(const SimulatedSequence& sequence, const Pose& truth, int frames, std::uint64_t seed) {
  Backends backends;
  ParticleFilter filter = backends.make_filter();
  Belief belief = filter.start(sequence.scene, seed);
  TurnRun run;
  for (int frame = 0; frame < frames; ++frame) {
    belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
    run.last = belief::estimate(belief, belief.objects[0]);
    const SymmetryGroup& symmetry = belief.scene->models[0].symmetry;
    run.last_right = (run.last.mean.translation - truth.translation).norm() < kRightShift &&
                     geometry::symmetric_angle(run.last.mean, truth, symmetry) < kRightTurn;
    const bool is_tracked = belief.objects[0].state == belief::TrackState::kTracked;
    ++run.frames;
    run.tracked += is_tracked;
    run.wrong += is_tracked && !run.last_right;
  }
  return run;
}

TEST(RivalTurns, OfAMugThatIsFoundWithItsHandleBehindNoneIsSure) {
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const Pose truth = mug_pose(angle_behind());
    SimulatedSequence sequence = still_sequence({mug_with_handle()}, {truth});
    sequence.scene = open_scene({mug_with_handle()});
    sequence.seed = seed;
    const TurnRun run = turn_run(sequence, truth, 1, seed);
    EXPECT_EQ(run.tracked, 1) << seed;
    EXPECT_LT(run.last.confidence, 0.7) << seed;
    EXPECT_LT((run.last.mean.translation - truth.translation).norm(), kRightShift) << seed;
  }
}

TEST(RivalTurns, OfAMugWhoseHandleIsSeenAreGoneWithinAFewFrames) {
  const Pose truth = mug_pose(angle_behind() + 0.5 * std::numbers::pi);
  SimulatedSequence sequence = still_sequence({mug_with_handle()}, {truth});
  sequence.scene = open_scene({mug_with_handle()});
  const TurnRun run = turn_run(sequence, truth, 15, 3);
  EXPECT_TRUE(run.last_right);
  EXPECT_GT(run.last.confidence, 0.9);
}

// What was known is not forgotten because the frames do not show it.
TEST(RivalTurns, OfAMugThatIsKnownAreNotBelievedBecauseItsHandleIsHidden) {
  const Pose truth = mug_pose(angle_behind());
  const TurnRun run = turn_run(still_sequence({mug_with_handle()}, {truth}), truth, 25, 4);
  EXPECT_EQ(run.wrong, 0);
  EXPECT_GT(run.last.confidence, 0.9);
}

// A block that lies still and is taken for one on another of its sides.
TEST(RivalTurns, ABlockThatIsTakenForATurnedOneIsTurnedBack) {
  belief::ObjectModel block = box_model("block", {0.10, 0.13, 0.09});
  block.symmetry = SymmetryGroup::cuboid();
  const Pose truth{geometry::exp_rotation({0.0, 0.0, 0.5}), {0.02, -0.03, 0.045}};
  Pose taken = truth;
  taken.rotation = truth.rotation * geometry::exp_rotation({0.5 * std::numbers::pi, 0.0, 0.0});
  taken.translation.z() = 0.065;
  SimulatedSequence sequence = still_sequence({block}, {truth});
  sequence.scene = table_scene({block}, {taken}, 0.003, 0.03);
  const TurnRun run = turn_run(sequence, truth, 60, 5);
  EXPECT_TRUE(run.last_right);
}

TEST(FindRivals, AreTurnedAgainstThePoseAndEachOther) {
  Backends backends;
  const Pose truth = mug_pose(angle_behind());
  const SimulatedSequence sequence = still_sequence({mug_with_handle(), can_model("can", 0.035, 0.12)},
                                                    {truth, Pose::from_translation({0.02, 0.15, 0.06})});
  const FilterFrame frame = backends.frame_of(sequence.scene, sequence.observe(3, *backends.renderer));
  const SearchTarget mug = target_of(sequence.scene->models[0], frame, backends.tools);
  const std::vector<Rival> rivals =
      find_rivals(frame, frame.terms, mug, {}, std::span(&truth, 1), -2.0, {}, {}, backends.tools);
  EXPECT_GE(rivals.size(), 2U);
  for (std::size_t i = 0; i < rivals.size(); ++i) {
    EXPECT_GE(geometry::symmetric_angle(rivals[i].X_WO, truth, {}), kRivalTurn);
    EXPECT_LT((rivals[i].X_WO.translation - truth.translation).norm(), 0.02);
    EXPECT_GE(rivals[i].log_odds, -2.0);
    if (i > 0) {
      EXPECT_LE(rivals[i].log_odds, rivals[i - 1].log_odds);
    }
    for (std::size_t j = 0; j < i; ++j)
      EXPECT_GE(geometry::symmetric_angle(rivals[i].X_WO, rivals[j].X_WO, {}), 0.9 * kRivalTurn);
  }
  // Turns that the symmetry allows are none.
  const SearchTarget can = target_of(sequence.scene->models[1], frame, backends.tools);
  const Pose X_can = sequence.objects[1](0.0);
  EXPECT_TRUE(find_rivals(frame, frame.terms, can, SymmetryGroup::continuous(Vector3d::UnitZ(), true),
                          std::span(&X_can, 1), -2.0, {}, {}, backends.tools)
                  .empty());
  EXPECT_TRUE(find_rivals(frame, frame.terms, can, SymmetryGroup::every_rotation(), std::span(&X_can, 1), -2.0, {}, {},
                          backends.tools)
                  .empty());
}

std::vector<Particle> two_turns(double first, double second) {
  std::vector<Particle> particles(3);
  particles[1].X_WO.rotation = geometry::exp_rotation({0.0, 0.0, 0.05});
  particles[2].X_WO.rotation = geometry::exp_rotation({0.0, 0.0, 1.0});
  particles[0].log_weight = first - std::log(2.0);
  particles[1].log_weight = first - std::log(2.0) - 1.0;
  particles[2].log_weight = second;
  belief::normalize(particles);
  return particles;
}

double log_odds_of_two(const std::vector<Particle>& p) {
  return std::log(std::exp(p[0].log_weight) + std::exp(p[1].log_weight)) - p[2].log_weight;
}

/// `nats` of evidence in favour of the first turn in each of some frames.
double after_frames(double nats, int frames, double turned = kSlipLogOdds) {
  std::vector<Particle> particles = two_turns(0.0, 0.0);
  for (int i = 0; i < frames; ++i) {
    std::vector<double> before;
    for (const Particle& particle : particles) before.push_back(particle.log_weight);
    particles[0].log_weight += nats;
    particles[1].log_weight += nats;
    belief::normalize(particles);
    share_among_turns(before, {}, particles, 1, turned);
    EXPECT_NEAR(particles[0].log_weight - particles[1].log_weight, 1.0, 1e-9);
  }
  return log_odds_of_two(particles);
}

TEST(ShareAmongTurns, LogOddsGoToWhatAFrameSays) {
  EXPECT_NEAR(after_frames(0.0, 400), 0.0, 1e-6);
  EXPECT_NEAR(after_frames(2.0, 400), 2.0, 1e-6);
  EXPECT_NEAR(after_frames(-2.5, 400), -2.5, 1e-6);
}

TEST(ShareAmongTurns, WhatWasDecidedAgainstFallsFurther) {
  EXPECT_NEAR(after_frames(5.0, 400), 10.0, 1e-6);
  EXPECT_NEAR(after_frames(-5.0, 400), -10.0, 1e-6);
}

TEST(ShareAmongTurns, FramesAloneDecideWhereTheTurnWasNotKnown) {
  EXPECT_NEAR(after_frames(5.0, 400, 0.0), 5.0, 1e-6);
  EXPECT_NEAR(after_frames(5.0, 400, -1.5), 6.5, 1e-6);
}

TEST(TurnedLogOdds, AreThoseOfTheScenesPrior) {
  const auto odds = [](double sd_deg) {
    belief::SceneObject object;
    belief::NormalPose pose;
    pose.covariance(2, 2) = std::pow(sd_deg * geometry::kDegree, 2);
    object.pose = pose;
    return turned_log_odds(object);
  };
  EXPECT_EQ(odds(0.0), kSlipLogOdds);
  EXPECT_EQ(odds(2.0), kSlipLogOdds);
  EXPECT_NEAR(odds(15.0), std::log(0.31731), 1e-4);  // outside of one standard deviation
  EXPECT_EQ(odds(40.0), 0.0);
  belief::SceneObject held;
  held.held_by = "hand";
  EXPECT_EQ(turned_log_odds(held), kSlipLogOdds);
}

TEST(ShareAmongTurns, LeavesOneTurnAlone) {
  std::vector<Particle> particles = two_turns(0.0, -2.0);
  const std::vector<Particle> as_given = particles;
  const std::vector<double> before(3, -std::log(3.0));
  share_among_turns(before, SymmetryGroup::continuous(Vector3d::UnitZ(), false), particles);
  EXPECT_EQ(particles, as_given);
  share_among_turns(before, SymmetryGroup::every_rotation(), particles);
  EXPECT_EQ(particles, as_given);
}

TEST(Estimate, OfTwoTurnsIsTheLikelierOneAndNotBetweenThem) {
  belief::ObjectBelief object;
  object.particles = two_turns(0.0, -0.4);
  for (Particle& particle : object.particles) particle.covariance.diagonal().setConstant(1e-6);
  const belief::ObjectEstimate estimate = belief::estimate(object);
  const double turn = geometry::log_rotation(estimate.mean.rotation).norm();
  EXPECT_LT(turn, 0.05);
  EXPECT_NEAR(estimate.confidence, 1.0 - std::exp(object.particles[2].log_weight), 0.02);
}

}  // namespace
}  // namespace prescene::filter_tests
