// SPDX-License-Identifier: Apache-2.0
// Laws of particles that are worlds: which objects share them, and what predicting, weighing and resampling them keeps.
#include "prescene/filter/operators/worlds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "filter_fixture.h"
#include "prescene/filter/operators/world_terms.h"
#include "pushed_box.h"

namespace prescene::filter_tests::worlds_test {
namespace {

using belief::Belief;
using belief::MotionMode;
using belief::Particle;

constexpr std::size_t kWorlds = 16;

/// Particles of equal weight, about x (m, in W) at height z.
std::vector<Particle> particles_at(double x, double z, MotionMode mode, double deviation = 0.001) {
  std::vector<Particle> particles(kWorlds);
  for (Particle& particle : particles) {
    particle.log_weight = -std::log(static_cast<double>(kWorlds));
    particle.X_WO = Pose::from_translation({x, 0.0, z});
    particle.covariance.diagonal().head<3>().setConstant(1e-6);
    particle.covariance.diagonal().segment<3>(3).setConstant(deviation * deviation);
    particle.mode = mode;
  }
  return particles;
}

/// Boxes of 10 cm on the table at these places.
Belief boxes_at(const std::vector<double>& places, MotionMode mode, double deviation = 0.001) {
  std::vector<belief::ObjectModel> models;
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < places.size(); ++i) {
    models.push_back(box_model("box_" + std::to_string(i), {0.1, 0.1, 0.1}));
    poses.push_back(Pose::from_translation({places[i], 0.0, 0.05}));
  }
  Belief belief;
  belief.scene = table_scene(models, poses, 0.001, 0.001);
  belief.seed = 3;
  belief.step = 1;
  for (std::size_t i = 0; i < places.size(); ++i) {
    belief::ObjectBelief& object = belief.objects.emplace_back();
    object.name = models[i].name;
    object.model = static_cast<int>(i);
    object.island = static_cast<int>(i);
    object.particles = particles_at(places[i], 0.05, mode, deviation);
  }
  return belief;
}

std::vector<Island> islands_of(const Belief& belief, const WorldsOptions& options = {}) {
  TouchTest touch;
  core::ThreadPool threads(1);
  return islands_that_change(belief, 1.0 / 30.0, options, touch, threads);
}

TEST(Islands, WhatRestsHasNone) { EXPECT_TRUE(islands_of(boxes_at({0.0, 0.1, 0.2}, MotionMode::kResting)).empty()); }

TEST(Islands, WhatMovesSharesOneWithWhatItMayTouch) {
  Belief belief = boxes_at({0.0, 0.101, 0.4}, MotionMode::kResting);
  for (Particle& particle : belief.objects[0].particles) particle.mode = MotionMode::kMoving;
  EXPECT_EQ(islands_of(belief), std::vector<Island>({{0, 1}}));
  belief.objects[1].existence = 0.1;
  EXPECT_TRUE(islands_of(belief).empty());
}

TEST(Islands, HowWellPlacesAreKnownDecides) {
  // 4 cm apart: surely so if places are known to a millimetre, hardly if to two centimetres.
  EXPECT_TRUE(islands_of(boxes_at({0.0, 0.14}, MotionMode::kMoving, 0.001)).empty());
  EXPECT_EQ(islands_of(boxes_at({0.0, 0.14}, MotionMode::kMoving, 0.02)), std::vector<Island>({{0, 1}}));
}

TEST(Islands, HaveNoMoreMembersThanAreAllowed) {
  const Belief belief = boxes_at({0.0, 0.1, 0.2, 0.3, 0.4}, MotionMode::kMoving);
  EXPECT_EQ(islands_of(belief), std::vector<Island>({{0, 1, 2, 3}}));
  EXPECT_EQ(islands_of(belief, {.most_members = 2}), std::vector<Island>({{0, 1}, {2, 3}}));
}

/// Particle i of box b begins at x = b + 0.001 i: what it is a copy of.
std::size_t source_of(const Particle& particle, double place) {
  return static_cast<std::size_t>(std::lround((particle.X_WO.translation.x() - place) / 0.001));
}

Belief numbered_boxes() {
  Belief belief = boxes_at({0.0, 1.0}, MotionMode::kResting);
  for (std::size_t b = 0; b < 2; ++b)
    for (std::size_t i = 0; i < kWorlds; ++i)
      belief.objects[b].particles[i].X_WO.translation.x() = static_cast<double>(b) + 0.001 * static_cast<double>(i);
  return belief;
}

TEST(JoinWorlds, DrawsFromTheProduct) {
  Belief sets = numbered_boxes();
  // Halves of 0.75 and 0.25 of the first, and of 0.6 and 0.4 of the second.
  for (std::size_t i = 0; i < kWorlds; ++i) {
    sets.objects[0].particles[i].log_weight = std::log((i < 8 ? 0.75 : 0.25) / 8.0);
    sets.objects[1].particles[i].log_weight = std::log((i < 8 ? 0.6 : 0.4) / 8.0);
  }
  std::array<std::array<double, 2>, 2> mass{};
  constexpr int kSeeds = 400;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Belief belief = sets;
    ASSERT_TRUE(join_worlds({0, 1}, {}, {static_cast<std::uint64_t>(seed), core::Purpose::kStartBelief}, belief));
    ASSERT_TRUE(are_worlds(belief, {0, 1}));
    for (std::size_t i = 0; i < kWorlds; ++i) {
      const bool first = source_of(belief.objects[0].particles[i], 0.0) < 8;
      const bool second = source_of(belief.objects[1].particles[i], 1.0) < 8;
      mass[first ? 0 : 1][second ? 0 : 1] += std::exp(belief.objects[0].particles[i].log_weight) / kSeeds;
    }
    const Belief joined = belief;
    EXPECT_FALSE(join_worlds({0, 1}, {}, {9, core::Purpose::kStartBelief}, belief));
    EXPECT_EQ(belief, joined);
  }
  // 400 draws of 16 pairs: 0.006 is a standard error; that the likeliest meet adds up to 1 / 16 of what they lack.
  EXPECT_NEAR(mass[0][0], 0.45, 0.05);
  EXPECT_NEAR(mass[0][1], 0.30, 0.05);
  EXPECT_NEAR(mass[1][0], 0.15, 0.05);
  EXPECT_NEAR(mass[1][1], 0.10, 0.05);
}

TEST(ResampleWorlds, KeepsThemWholeAndOneOfEachKind) {
  Belief belief = numbered_boxes();
  // World 5 carries most, world 9 is the only one in which the second box is turned.
  for (belief::ObjectBelief& object : belief.objects)
    for (std::size_t i = 0; i < kWorlds; ++i)
      object.particles[i].log_weight = std::log(i == 5 ? 0.83 : i == 9 ? 0.03 : 0.01);
  belief.objects[1].particles[9].X_WO.rotation = geometry::exp_rotation({0.0, 0.0, 0.7});
  ASSERT_TRUE(resample_worlds({0, 1}, {}, {4, core::Purpose::kResample}, belief));
  double of_nine = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < kWorlds; ++i) {
    const Particle& first = belief.objects[0].particles[i];
    EXPECT_EQ(source_of(first, 0.0), source_of(belief.objects[1].particles[i], 1.0)) << i;
    EXPECT_EQ(first.log_weight, belief.objects[1].particles[i].log_weight);
    of_nine += source_of(first, 0.0) == 9 ? std::exp(first.log_weight) : 0.0;
    sum += std::exp(first.log_weight);
  }
  EXPECT_NEAR(sum, 1.0, 1e-9);
  EXPECT_NEAR(of_nine, 0.03, 1e-9);
  EXPECT_EQ(source_of(belief.objects[0].particles[0], 0.0), 5u);
}

TEST(CombineWeights, MultipliesWhatIsSaidOfEach) {
  Belief belief = numbered_boxes();
  const std::vector<double> before = world_weights(belief, {0, 1});
  belief.objects[0].particles[2].log_weight += 1.5;
  belief.objects[1].particles[2].log_weight += 0.5;
  belief.objects[1].particles[7].log_weight -= 3.0;
  ASSERT_TRUE(combine_weights({0, 1}, before, belief));
  EXPECT_TRUE(are_worlds(belief, {0, 1}));
  const std::vector<double> after = world_weights(belief, {0, 1});
  EXPECT_NEAR(after[2] - after[0], 2.0, 1e-12);
  EXPECT_NEAR(after[7] - after[0], -3.0, 1e-12);
}

/// How deep the second box reaches into the first along x, at most over pairs that `shift` tells, m.
double deepest(const Belief& belief, std::size_t shift) {
  double most = 0.0;
  for (std::size_t i = 0; i < kWorlds; ++i) {
    const Pose& first = belief.objects[0].particles[i].X_WO;
    const Pose& second = belief.objects[1].particles[(i + shift) % kWorlds].X_WO;
    most = std::max(most, 0.1 - (second.translation.x() - first.translation.x()));
  }
  return most;
}

/// A box slides against another, and where both are is known to a centimetre only, but not where one is given the
/// other. Worlds are predicted without interpenetration beyond a millimetre of slop, each for itself with 1 cm and
/// more.
TEST(PredictWorlds, NoneHasItsMembersInsideEachOther) {
  Belief start = boxes_at({0.0, 0.101}, MotionMode::kResting);
  core::RandomStream stream(5, core::Purpose::kTest);
  for (std::size_t i = 0; i < kWorlds; ++i) {
    const double shift = 0.01 * stream.normal();
    for (std::size_t b = 0; b < 2; ++b) start.objects[b].particles[i].X_WO.translation.x() += shift;
    start.objects[0].particles[i].mode = MotionMode::kMoving;
    start.objects[0].particles[i].V_WO.linear.x() = 0.5;
  }
  PredictOptions options;
  options.wake_probability = options.settle_probability = 0.0;
  options.physics_share = 1.0;
  core::ThreadPool threads(2);
  const auto predicted = [&](std::span<const Island> islands, PredictReport* report) {
    Belief belief = start;
    RobotBounds bounds;
    *report = predict(belief, {}, {}, 0.05, options,
                      {push_simulators(), bounds, {3, core::Purpose::kProcessNoise}, threads}, islands);
    EXPECT_EQ(report->not_simulated, 0) << report->failure;
    return belief;
  };
  PredictReport joint_report, apart_report;
  const Belief apart = predicted({}, &apart_report);
  const std::vector<Island> islands = {{0, 1}};
  const Belief joint = predicted(islands, &joint_report);
  EXPECT_EQ(joint_report.pushed, static_cast<int>(kWorlds));
  EXPECT_EQ(joint_report.simulated, static_cast<int>(kWorlds));
  EXPECT_LT(deepest(joint, 0), 0.002);
  EXPECT_GT(deepest(apart, 0), 0.01);
  EXPECT_GT(deepest(joint, 1), 0.01);  // particles of different worlds don't belong together
  for (const Particle& particle : joint.objects[1].particles) {
    EXPECT_EQ(particle.mode, MotionMode::kMoving);
    EXPECT_GT(particle.V_WO.linear.x(), 0.08);
  }
  for (const Particle& particle : apart.objects[1].particles) EXPECT_EQ(particle.mode, MotionMode::kResting);
}

/// Two equal boxes that touch, one half in front of the other. The joint weights of nine worlds are those of the
/// picture of both: the evidence of the one behind alone, and that of the one in front where the other is known to be
/// behind it.
TEST(WeighWorlds, AgreesWithTheEnumeratedPosteriorOfTwins) {
  Backends backends;
  const Vector3d size(0.08, 0.10, 0.12);
  const Pose X_front = Pose::from_translation({0.0, 0.0, 0.06}), X_behind = Pose::from_translation({0.081, 0.03, 0.06});
  const SimulatedSequence sequence =
      still_sequence({box_model("front", size), box_model("behind", size)}, {X_front, X_behind});
  const FilterFrame frame = backends.frame_of(sequence.scene, sequence.observe(30, *backends.renderer));
  const std::array<SearchTarget, 2> targets = {target_of(sequence.scene->models[0], frame, backends.tools),
                                               target_of(sequence.scene->models[1], frame, backends.tools)};
  const double shifts[] = {-0.015, 0.0, 0.015};
  std::array<std::vector<Particle>, 2> particles;
  for (const double first : shifts)
    for (const double second : shifts) {
      Particle particle;
      particle.log_weight = -std::log(9.0);
      particle.covariance = 1e-12 * belief::Matrix12d::Identity();
      particle.mode = MotionMode::kMoving;
      particle.X_WO = X_front;
      particle.X_WO.translation.y() += first;
      particles[0].push_back(particle);
      particle.X_WO = X_behind;
      particle.X_WO.translation.y() += second;
      particles[1].push_back(particle);
    }
  WeightOptions options;
  options.min_outline = -1.0;  // outlines count in full
  options.full_outline = 0.0;
  const auto pixels_of = [&](std::size_t m) {
    return tempering_pixels(frame.terms, targets[m], frame.X_CW * particles[m][4].X_WO, backends.tools);
  };
  const double pixels = 0.5 * (pixels_of(0) + pixels_of(1));
  std::vector<double> joint(9, 0.0);
  std::array<std::vector<Particle>, 2> weighed = particles;
  for (std::size_t m = 0; m < 2; ++m) {
    const WorldTerms terms =
        world_terms(frame, {targets[m], &particles[m]}, {{targets[1 - m], &particles[1 - m]}}, {}, backends.tools);
    ASSERT_EQ(terms.terms_of.size(), 9u);
    weight(frame.terms, targets[m], frame.X_WC, 1.0 / 30.0, options, backends.tools, {5, core::Purpose::kProposal},
           weighed[m], {.terms_of = terms.terms_of, .weight_pixels = pixels});
    for (std::size_t i = 0; i < 9; ++i) joint[i] += weighed[m][i].log_weight;
  }
  const rendering::WorkspacePool::Loan workspace(backends.search.workspaces());
  const auto log_ratio = [&](const rendering::FrameTerms& terms, std::size_t m, const Pose& X_WO) {
    const rendering::PoseHypothesis h = hypothesis(targets[m], frame.X_CW * X_WO);
    rendering::PoseEvidence evidence;
    backends.likelihood->evaluate(terms, std::span(&h, 1), *workspace, std::span(&evidence, 1));
    return evidence.log_ratio;
  };
  const double share = rendering::tempering(frame.terms.tempering.weight, pixels, frame.terms.step);
  std::vector<double> enumerated(9, 0.0);
  for (std::size_t i = 0; i < 9; ++i) {
    const geometry::DepthImage behind =
        depth_of(targets[1], frame.X_CW * particles[1][i].X_WO, frame.terms.camera, *backends.renderer);
    rendering::FrameTerms with_behind;
    rendering::with_known_surfaces(frame.terms, behind, &with_behind);
    enumerated[i] =
        share * (log_ratio(frame.terms, 1, particles[1][i].X_WO) + log_ratio(with_behind, 0, particles[0][i].X_WO));
  }
  const auto normalized = [](std::vector<double> logs) {
    const double most = *std::max_element(logs.begin(), logs.end());
    double sum = 0.0;
    for (double& value : logs) sum += value = std::exp(value - most);
    for (double& value : logs) value /= sum;
    return logs;
  };
  const std::vector<double> a = normalized(joint), b = normalized(enumerated);
  double variation = 0.0;
  for (std::size_t i = 0; i < 9; ++i) variation += 0.5 * std::abs(a[i] - b[i]);
  EXPECT_LT(variation, 0.05);
  EXPECT_EQ(std::max_element(a.begin(), a.end()) - a.begin(), 4);  // both where they are
}

/// A box on a box that is pushed along.
SimulatedSequence pushed_stack() {
  const Pose X_lower = Pose::from_translation({0.0, 0.0, 0.04}), X_upper = Pose::from_translation({0.0, 0.0, 0.12});
  SimulatedSequence sequence = still_sequence(
      {box_model("lower", {0.12, 0.12, 0.08}), box_model("upper", {0.07, 0.09, 0.08})}, {X_lower, X_upper});
  const auto along = [](const Pose& X) {
    return [X](double time) {
      Pose moved = X;
      moved.translation.y() += 0.15 * std::clamp(time - 0.2, 0.0, 0.6);
      return moved;
    };
  };
  sequence.objects = {along(X_lower), along(X_upper)};
  return sequence;
}

struct Tracked {
  std::uint64_t hash = 0;
  int joint_islands = 0;
  double largest_error = 0.0;
};

Tracked track(const SimulatedSequence& sequence, bool joint, int threads, int frames) {
  Backends backends(threads);
  FilterSettings settings;
  settings.worlds.joint = joint;
  ParticleFilter filter = backends.make_filter(settings, push_simulators());
  Belief belief = filter.start(sequence.scene, 7);
  Tracked tracked;
  for (int frame = 0; frame < frames; ++frame) {
    StepResult result = filter.step(belief, sequence.observe(frame, *backends.renderer), {});
    belief = std::move(result.belief);
    tracked.joint_islands += result.counters.joint_islands;
    for (std::size_t i = 0; frame > 3 && i < belief.objects.size(); ++i)
      tracked.largest_error =
          std::max(tracked.largest_error, (belief::estimate(belief, belief.objects[i]).mean.translation -
                                           sequence.objects[i](sequence.time_of(frame)).translation)
                                              .norm());
  }
  tracked.hash = belief::content_hash(belief);
  return tracked;
}

TEST(ParticleFilterWithWorlds, FollowsAStackWithTheSameBitsForAnyThreads) {
  const SimulatedSequence sequence = pushed_stack();
  const Tracked one = track(sequence, true, 1, 20);
  EXPECT_GT(one.joint_islands, 5);
  EXPECT_LT(one.largest_error, 0.02);
  EXPECT_EQ(track(sequence, true, 2, 20).hash, one.hash);
}

TEST(ParticleFilterWithWorlds, LeavesWhatIsAloneAsItIs) {
  SimulatedSequence sequence =
      still_sequence({box_model("a", {0.08, 0.08, 0.08}), box_model("b", {0.08, 0.08, 0.08})},
                     {Pose::from_translation({0.0, 0.2, 0.04}), Pose::from_translation({0.0, -0.2, 0.04})});
  const Tracked joint = track(sequence, true, 2, 8);
  EXPECT_EQ(joint.joint_islands, 0);
  EXPECT_EQ(joint.hash, track(sequence, false, 2, 8).hash);
}

}  // namespace
}  // namespace prescene::filter_tests::worlds_test
