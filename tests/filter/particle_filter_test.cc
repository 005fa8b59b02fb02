// SPDX-License-Identifier: Apache-2.0
// The whole filter on simulated sequences with known truth.
#include "prescene/filter/particle_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "filter_fixture.h"
#include "prescene/geometry/pose_error.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::filter_tests {
namespace {

using belief::Belief;
using belief::TrackState;

geometry::AddsEvaluator errors_of(const belief::ObjectModel& model) {
  std::vector<Vector3d> points;
  for (const auto& point : geometry::sample_surface(*model.visual, 500, 3)) points.push_back(point.position);
  return geometry::AddsEvaluator(std::move(points));
}

/// A carton that is carried about in the air at the given speeds.
SimulatedSequence carried_carton(double speed, double rate, std::uint64_t seed) {
  const Pose X_WO = Pose::from_translation({0.0, 0.0, 0.20});
  SimulatedSequence sequence = still_sequence({carton_model("carton")}, {X_WO});
  sequence.objects = {wandering(X_WO, speed, rate, seed)};
  sequence.seed = seed;
  return sequence;
}

TEST(ParticleFilter, TracksAMovingCarton) {
  Backends backends;
  const SimulatedSequence sequence = carried_carton(0.22, 1.44, 103);
  ParticleFilter filter = backends.make_filter();
  const geometry::AddsEvaluator errors = errors_of(sequence.scene->models[0]);
  Belief belief = filter.start(sequence.scene, 7);
  std::vector<double> adds;
  for (int frame = 0; frame < 45; ++frame) {
    StepResult result = filter.step(belief, sequence.observe(frame, *backends.renderer), {});
    EXPECT_EQ(result.degraded, 0u) << degraded_text(result.degraded);
    belief = std::move(result.belief);
    adds.push_back(errors.adds(belief::estimate(belief.objects[0]).mode, sequence.objects[0](sequence.time_of(frame))));
    if (frame > 1) {
      EXPECT_EQ(belief.objects[0].state, TrackState::kTracked) << "frame " << frame;
    }
  }
  EXPECT_LT(*std::max_element(adds.begin(), adds.end()), 0.02);
  std::nth_element(adds.begin(), adds.begin() + 22, adds.end());
  EXPECT_LT(adds[22], 0.005);
}

TEST(ParticleFilter, PreparesWhatStepsTakeAndChangesNoBelief) {
  Backends backends;
  const SimulatedSequence sequence = carried_carton(0.22, 1.44, 103);
  const belief::Observation first = sequence.observe(0, *backends.renderer);
  int simulators = 0;
  const simulation::SimulatorFactory failing = [&](const belief::Scene& scene,
                                                   double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
    simulators += static_cast<int>(scene.objects.size());
    return core::unsupported("none");
  };
  ParticleFilter prepared = backends.make_filter({}, failing), other = backends.make_filter({}, failing);
  prepared.prepare(*sequence.scene);
  EXPECT_EQ(simulators, 1);
  EXPECT_EQ(belief::content_hash(prepared.step(prepared.start(sequence.scene, 7), first, {}).belief),
            belief::content_hash(other.step(other.start(sequence.scene, 7), first, {}).belief));
}

TEST(ParticleFilter, ARobotBodyThatIsNotNamedStandsWhereItWasLast) {
  Backends backends;
  SimulatedSequence sequence =
      still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {Pose::from_translation({0.0, 0.0, 0.09})});
  auto scene = std::make_shared<belief::Scene>(*sequence.scene);
  const Pose X_begin = Pose::from_translation({0.3, 0.0, 0.9}), X_end = Pose::from_translation({-0.3, 0.0, 0.9}),
             X_named = Pose::from_translation({0.2, 0.1, 0.9});
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.timeline = {{0.0, X_begin}, {2.0, X_end}};
  scene->robot.push_back(hand);
  sequence.scene = scene;
  ParticleFilter filter = backends.make_filter();
  Belief belief = filter.start(sequence.scene, 7);
  const std::optional<Pose> named[] = {std::nullopt, X_named, std::nullopt};
  const Pose expected[] = {X_begin, X_named, X_named};
  for (int frame = 0; frame < 3; ++frame) {
    belief::Observation observation = sequence.observe(frame, *backends.renderer);
    observation.stamp_ns += 1'700'000'000'000'000'000;  // Of a clock that knows nothing of the scene's timeline.
    observation.robot.clear();
    if (named[frame]) observation.robot["hand"] = *named[frame];
    StepResult result = filter.step(belief, observation, {});
    belief = std::move(result.belief);
    EXPECT_EQ(belief.robot.at(0), expected[frame]) << frame;
    EXPECT_EQ(result.degraded, named[frame] ? 0u : std::uint32_t{kRobotPoseAssumed}) << degraded_text(result.degraded);
  }
}

TEST(ParticleFilter, ARestingObjectStaysStill) {
  Backends backends;
  const Pose X_WO = Pose::from_translation({0.0, 0.0, 0.09});
  const SimulatedSequence sequence = still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {X_WO});
  ParticleFilter filter = backends.make_filter();
  Belief belief = filter.start(sequence.scene, 7);
  Vector3d last = Vector3d::Zero();
  for (int frame = 0; frame < 25; ++frame) {
    belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
    const belief::ObjectEstimate estimate = belief::estimate(belief.objects[0]);
    if (frame > 10) {
      EXPECT_LT((estimate.mean.translation - last).norm(), 0.003) << frame;
      EXPECT_LT((estimate.mean.translation - X_WO.translation).norm(), 0.006) << frame;
    }
    last = estimate.mean.translation;
  }
  EXPECT_EQ(belief::estimate(belief.objects[0]).motion, belief::MotionMode::kResting);
}

/// A box in a hand, which opens after 0.6 s without a word; the box falls onto the table 15 cm below.
TEST(ParticleFilter, WhatIsSeenToLeaveItsHandIsNotHeldAnyMore) {
  Backends backends;
  const Pose X_WO = Pose::from_translation({0.0, 0.0, 0.20});
  SimulatedSequence sequence = still_sequence({box_model("box", {0.08, 0.08, 0.10})}, {X_WO});
  auto scene = std::make_shared<belief::Scene>(*sequence.scene);
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{Vector3d(0.04, 0.04, 0.06)}, {}});
  hand.timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.285})}};
  scene->robot.push_back(hand);
  scene->objects[0].held_by = "hand";
  sequence.scene = scene;
  sequence.objects = {[](double time) {
    const double fallen = 0.5 * 9.81 * std::pow(std::max(0.0, time - 0.6), 2);
    return Pose::from_translation({0.0, 0.0, std::max(0.05, 0.20 - fallen)});
  }};
  ParticleFilter filter = backends.make_filter();
  Belief belief = filter.start(sequence.scene, 7);
  int released = 0;
  std::optional<int> released_at;
  for (int frame = 0; frame < 40; ++frame) {
    StepResult result = filter.step(belief, sequence.observe(frame, *backends.renderer), {});
    belief = std::move(result.belief);
    released += result.counters.inferred_releases;
    if (result.counters.inferred_releases > 0) released_at = frame;
    if (frame < 18) {
      EXPECT_EQ(belief.scene->objects[0].held_by, "hand") << frame;
    }
  }
  EXPECT_EQ(released, 1);
  ASSERT_TRUE(released_at.has_value());
  EXPECT_LE(*released_at, 32);
  EXPECT_FALSE(belief.scene->objects[0].held_by.has_value());
  EXPECT_EQ(belief.objects[0].state, TrackState::kTracked);
  EXPECT_LT((belief::estimate(belief.objects[0]).mode.translation - Vector3d(0.0, 0.0, 0.05)).norm(), 0.015);
}

/// A plate hides the object from 0.7 s to 1.7 s; it is followed until 2.6 s.
struct Hiding {
  int hidden = 0, unseen = 0, confidently_wrong = 0;
  bool found_again = false;
};
Hiding hide(const SimulatedSequence& base, std::uint64_t seed) {
  Backends backends;
  SimulatedSequence sequence = base;
  sequence.occluders.push_back(plate(sequence.X_WC, sequence.objects[0], 0.12, 0.34, 0.34, 0.7, 1.7));
  ParticleFilter filter = backends.make_filter();
  const geometry::AddsEvaluator errors = errors_of(sequence.scene->models[0]);
  Belief belief = filter.start(sequence.scene, seed);
  Hiding result;
  for (int frame = 0; frame < 78; ++frame) {
    belief = filter.step(belief, sequence.observe(frame, *backends.renderer), {}).belief;
    const double adds =
        errors.adds(belief::estimate(belief.objects[0]).mode, sequence.objects[0](sequence.time_of(frame)));
    const TrackState state = belief.objects[0].state;
    if (sequence.visible_share(0, frame, *backends.renderer) < 0.02) {
      ++result.hidden;
      result.unseen += state == TrackState::kUnseen;
      result.confidently_wrong += state == TrackState::kTracked && adds > 0.02;
    }
    if (frame == 77) result.found_again = state == TrackState::kTracked && adds < 0.02;
  }
  return result;
}

TEST(ParticleFilter, AHiddenMovingObjectIsUnseenAndNotOnThePlate) {
  const Hiding result = hide(carried_carton(0.15, 1.0, 100), 7);
  EXPECT_GE(result.hidden, 28);
  EXPECT_GE(result.unseen, result.hidden * 8 / 10);
  EXPECT_EQ(result.confidently_wrong, 0);
  EXPECT_TRUE(result.found_again);
}

TEST(ParticleFilter, AHiddenRestingObjectIsWhereItWas) {
  const SimulatedSequence sequence =
      still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {Pose::from_translation({0.0, 0.0, 0.09})});
  const Hiding result = hide(sequence, 3);
  EXPECT_GE(result.hidden, 28);
  EXPECT_GE(result.unseen, result.hidden * 9 / 10);
  EXPECT_EQ(result.confidently_wrong, 0);
  EXPECT_TRUE(result.found_again);
}

TEST(ParticleFilter, FindsAnObjectThatWasPutElsewhereWhileHidden) {
  Backends backends;
  const Pose here = Pose::from_translation({0.0, -0.15, 0.09}), there = Pose::from_translation({0.05, 0.18, 0.09});
  SimulatedSequence sequence = still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {here});
  sequence.objects = {[=](double time) { return time < 0.5 ? here : there; }};
  ParticleFilter filter = backends.make_filter();
  Belief belief = filter.start(sequence.scene, 3);
  int recoveries = 0;
  for (int frame = 0; frame < 45; ++frame) {
    StepResult result = filter.step(belief, sequence.observe(frame, *backends.renderer), {});
    recoveries += result.counters.recoveries;
    belief = std::move(result.belief);
  }
  EXPECT_GE(recoveries, 1);
  EXPECT_EQ(belief.objects[0].state, TrackState::kTracked);
  EXPECT_LT((belief::estimate(belief.objects[0]).mode.translation - there.translation).norm(), 0.01);
}

TEST(ParticleFilter, FindsAllObjectsOfAnOpenSceneAndAddsOneThatComesLater) {
  Backends backends;
  std::vector<belief::ObjectModel> models = {box_model("box", {0.06, 0.10, 0.18}), can_model("can", 0.035, 0.11)};
  SimulatedSequence sequence =
      still_sequence({models[0], models[1], models[1]},
                     {Pose::from_translation({0.0, -0.15, 0.09}), Pose::from_translation({0.02, 0.05, 0.055}),
                      Pose::from_translation({-0.05, 0.20, 0.055})});
  const Motion second_can = sequence.objects[2];
  sequence.objects[2] = [=](double time) {
    return time < 0.1 ? Pose::from_translation({0.0, 0.0, -5.0}) : second_can(time);
  };
  FilterSettings settings;
  settings.augment.new_objects = true;
  settings.augment.new_every = 4;
  ParticleFilter filter = backends.make_filter(settings);
  Belief belief = filter.start(open_scene(models), 3);
  int added = 0;
  for (int frame = 0; frame < 9; ++frame) {
    StepResult result = filter.step(belief, sequence.observe(frame, *backends.renderer), {});
    if (frame == 0) {
      EXPECT_EQ(result.counters.found, 2);
    }
    added += result.counters.new_objects;
    belief = std::move(result.belief);
  }
  EXPECT_EQ(added, 1);
  ASSERT_EQ(belief.objects.size(), 3u);
  ASSERT_EQ(belief.scene->objects.size(), 3u);
  EXPECT_EQ(belief.objects[2].name, "can_2");
  EXPECT_LT((belief::estimate(belief.objects[2]).mode.translation - Vector3d(-0.05, 0.20, 0.055)).norm(), 0.015);
}

TEST(ParticleFilter, SameBitsForAnyNumberOfThreadsAndForARepeatedStep) {
  const SimulatedSequence sequence = carried_carton(0.22, 1.44, 104);
  std::vector<HashTrace> traces;
  for (const int threads : {1, 2, 3, 8}) {
    Backends backends(threads);
    ParticleFilter filter = backends.make_filter();
    filter.trace_stages(true);
    Belief belief = filter.start(sequence.scene, 7);
    HashTrace trace;
    for (int frame = 0; frame < 4; ++frame) {
      const belief::Observation observation = sequence.observe(frame, *backends.renderer);
      const StepResult once = filter.step(belief, observation, {});
      ParticleFilter another = backends.make_filter();
      another.trace_stages(true);
      StepResult again = another.step(belief, observation, {});
      EXPECT_FALSE(once.trace.empty());
      EXPECT_EQ(once.trace, again.trace);
      EXPECT_EQ(once.belief, again.belief);
      trace.insert(trace.end(), again.trace.begin(), again.trace.end());
      belief = std::move(again.belief);
    }
    traces.push_back(std::move(trace));
  }
  for (std::size_t i = 1; i < traces.size(); ++i) EXPECT_EQ(traces[i], traces[0]);
}

class BadFrames : public ::testing::Test {
 protected:
  BadFrames()
      : sequence_(still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {Pose::from_translation({0.0, 0.0, 0.09})})),
        filter_(backends_.make_filter()),
        belief_(filter_.step(filter_.start(sequence_.scene, 7), sequence_.observe(0, *backends_.renderer), {}).belief) {
  }

  void expect_rejected(const belief::Observation& observation, const std::string& word) {
    const StepResult result = filter_.step(belief_, observation, {});
    EXPECT_TRUE(result.degraded & kFrameRejected);
    EXPECT_NE(result.frame_status.message().find(word), std::string::npos) << result.frame_status.message();
    EXPECT_EQ(result.belief.step, belief_.step + 1);
    EXPECT_EQ(result.belief.objects[0].state, TrackState::kUnseen);
    for (const belief::Particle& particle : result.belief.objects[0].particles) EXPECT_TRUE(particle.X_WO.is_finite());
  }

  Backends backends_;
  SimulatedSequence sequence_;
  ParticleFilter filter_;
  Belief belief_;
};

TEST_F(BadFrames, AreRejectedWithAReasonAndPredictedOver) {
  belief::Observation observation = sequence_.observe(1, *backends_.renderer);
  belief::Observation no_depth = observation;
  no_depth.frame.depth = nullptr;
  expect_rejected(no_depth, "depth");
  belief::Observation wrong_size = observation;
  wrong_size.frame.camera.width = 100;
  expect_rejected(wrong_size, "100");
  belief::Observation no_pose = observation;
  no_pose.X_WC.translation.x() = std::nan("");
  expect_rejected(no_pose, "pose");
}

TEST_F(BadFrames, FullOfNonsenseAreSurvived) {
  belief::Observation observation = sequence_.observe(1, *backends_.renderer);
  auto depth = std::make_shared<geometry::DepthImage>(*observation.frame.depth);
  const float values[] = {std::nanf(""), INFINITY, -1.0f, 1e30f, 0.0f};
  for (std::size_t i = 0; i < depth->size(); ++i) depth->data()[i] = values[i % 5];
  observation.frame.depth = depth;
  const StepResult result = filter_.step(belief_, observation, {});
  for (const belief::Particle& particle : result.belief.objects[0].particles) {
    EXPECT_TRUE(particle.X_WO.is_finite());
    EXPECT_TRUE(particle.covariance.allFinite());
    EXPECT_TRUE(std::isfinite(particle.log_weight));
  }
  EXPECT_NE(result.belief.objects[0].state, TrackState::kTracked);
}

TEST_F(BadFrames, OlderThanTheBeliefChangeNothing) {
  const StepResult result = filter_.step(belief_, sequence_.observe(0, *backends_.renderer), {});
  EXPECT_EQ(result.degraded, kClockWentBack);
  EXPECT_EQ(result.belief, belief_);
}

TEST(ParticleFilter, SaysThatPhysicsFailedAndTracksOnWithoutIt) {
  Backends backends;
  const SimulatedSequence sequence = carried_carton(0.22, 1.44, 103);
  FilterSettings settings;
  settings.predict.physics_share = 0.5;
  ParticleFilter with_none = backends.make_filter(settings);
  ParticleFilter filter = backends.make_filter(
      settings, [](const belief::Scene&, double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
        return core::unsupported("carton: a surface can't move");
      });
  Belief belief = filter.start(sequence.scene, 7);
  int failed = 0;
  for (int frame = 0; frame < 6; ++frame) {
    const belief::Observation observation = sequence.observe(frame, *backends.renderer);
    const StepResult without = with_none.step(belief, observation, {});
    StepResult result = filter.step(belief, observation, {});
    EXPECT_EQ(result.belief, without.belief) << frame;
    EXPECT_EQ((result.degraded & kPhysicsFailed) != 0, result.counters.not_simulated > 0) << frame;
    EXPECT_EQ(result.physics_failure.find("a surface can't move") != std::string::npos,
              result.counters.not_simulated > 0)
        << result.physics_failure;
    EXPECT_EQ(result.counters.simulated, 0);
    failed += result.counters.not_simulated;
    belief = std::move(result.belief);
  }
  EXPECT_GT(failed, 0);
}

/// A renderer whose device is lost after some calls.
class LosingRenderer final : public rendering::Renderer {
 public:
  explicit LosingRenderer(rendering::Renderer& renderer) : renderer_(renderer) {}
  rendering::RendererInfo info() const override { return renderer_.info(); }
  core::Status render(std::span<const rendering::RenderJob> jobs, const rendering::RenderOptions& options,
                      std::span<rendering::RenderedView> views) override {
    if (lost) return core::unavailable("the graphics device was lost");
    return renderer_.render(jobs, options, views);
  }
  bool lost = false;

 private:
  rendering::Renderer& renderer_;
};

TEST(ParticleFilter, SaysThatPicturesCouldNotBeDrawn) {
  Backends backends;
  const SimulatedSequence sequence =
      still_sequence({box_model("box", {0.06, 0.10, 0.18})}, {Pose::from_translation({0.0, 0.0, 0.09})});
  LosingRenderer losing(*backends.renderer);
  ParticleFilter filter(*backends.likelihood, losing, backends.threads, {});
  Belief belief = filter.start(sequence.scene, 7);
  for (int frame = 0; frame < 3; ++frame) {
    losing.lost = frame == 1;
    StepResult result = filter.step(belief, sequence.observe(frame, *backends.renderer), {});
    EXPECT_EQ((result.degraded & kRenderingFailed) != 0, losing.lost) << frame;
    EXPECT_EQ(result.counters.not_drawn > 0, losing.lost) << frame;
    EXPECT_EQ(result.rendering_failure,
              losing.lost ? core::unavailable("the graphics device was lost") : core::ok_status());
    belief = std::move(result.belief);
  }
}

TEST(DegradedText, NamesEveryBit) {
  EXPECT_EQ(degraded_text(0), "");
  EXPECT_EQ(degraded_text(kFrameRejected | kLongGap), "frame rejected, long gap");
  EXPECT_EQ(degraded_text(kPhysicsFailed), "physics failed");
  std::set<std::string> names;
  for (std::uint32_t bit = kFrameRejected; bit <= kRenderingFailed; bit <<= 1) names.insert(degraded_text(bit));
  EXPECT_EQ(names.size(), 9u);
  EXPECT_FALSE(names.contains(""));
}

TEST(NumberIslands, JoinsWhatTouches) {
  Backends backends;
  const auto scene =
      table_scene({box_model("a", {0.1, 0.1, 0.1}), box_model("b", {0.1, 0.1, 0.1}), box_model("c", {0.1, 0.1, 0.1})},
                  {Pose::from_translation({0.3, 0.0, 0.05}), Pose::from_translation({0.0, 0.0, 0.05}),
                   Pose::from_translation({0.0, 0.0, 0.152})},
                  0.0001, 0.0001);
  Belief belief = backends.make_filter().start(scene, 1);
  number_islands(0.005, backends.meshes, belief);
  EXPECT_EQ(belief.objects[0].island, 0);
  EXPECT_EQ(belief.objects[1].island, 1);
  EXPECT_EQ(belief.objects[2].island, 1);
}

}  // namespace
}  // namespace prescene::filter_tests
