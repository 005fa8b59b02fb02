// SPDX-License-Identifier: Apache-2.0
// Physics in tracking, with the simulators that the service chooses: what falls does so wherever the world's origin
// lies, and what can't be simulated is told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/predict.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::tracked_physics_test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A box 1 m above a floor, both moved along x: a robot that drives takes its surroundings with it. A scene file itself
/// has to begin near the origin.
belief::Belief box_in_the_air(double x) {
  const auto loaded = load_scene_text(R"(name: box
models:
  box: {box: [0.1, 0.1, 0.1], mass: 0.4}
supports:
  floor: {box: [2, 2, 0.1], pose: {position: [0, 0, -0.05]}}
objects:
  box: {model: box, pose: {position: [0, 0, 1]}}
)",
                                      "box.yaml", {});
  EXPECT_TRUE(loaded.ok()) << loaded.status().message();
  belief::Belief belief = filter::belief_from_priors(*loaded, 1, 0, {});
  auto scene = std::make_shared<belief::Scene>(**loaded);
  scene->supports[0].X_WS.translation.x() += x;
  belief.scene = scene;
  belief.step = 1;
  for (belief::Particle& particle : belief.objects[0].particles) {
    particle.X_WO.translation.x() += x;
    particle.mode = belief::MotionMode::kMoving;
    particle.V_WO = {};
  }
  return belief;
}

TEST(TrackedPhysics, FallsFarFromTheOriginAsNearIt) {
  core::ThreadPool pool(1);
  for (const Stepper stepper : {Stepper::kBullet, Stepper::kLockstep}) {
    BackendSettings settings;
    settings.stepper = stepper;
    Backends backends(pool, settings);
    for (const double x : {0.0, 19.0, 25.0, 100.0}) {
      SCOPED_TRACE(x);
      belief::Belief belief = box_in_the_air(x);
      filter::PredictOptions options;
      options.settle_probability = 0.0;
      options.physics_share = 1.0;
      filter::RobotBounds bounds;
      const auto report =
          filter::predict(belief, {}, {}, 0.1, options,
                          {backends.simulator_factory(), bounds, {1, core::Purpose::kProcessNoise}, pool});
      EXPECT_EQ(report.simulated, static_cast<int>(belief.objects[0].particles.size())) << report.failure;
      for (const belief::Particle& particle : belief.objects[0].particles) {
        EXPECT_NEAR(particle.V_WO.linear.z(), -0.981, 1e-4);
        EXPECT_NEAR(particle.X_WO.translation.z(), 1.0 - 0.5 * 9.81 * 0.01, 1e-4);
        EXPECT_NEAR(particle.X_WO.translation.x(), x, 1e-4);
      }
    }
  }
}

TEST(TrackedPhysics, WhatIsNotSeenFallsNoFurtherThanTheLowestSurfaceThatWas) {
  core::ThreadPool pool(1);
  Backends backends(pool, {});
  for (const double lowest : {0.0, -0.4}) {
    belief::Belief belief = box_in_the_air(0.0);
    auto scene = std::make_shared<belief::Scene>(*belief.scene);
    scene->supports.clear();
    belief.scene = scene;
    belief.lowest_seen = lowest;
    belief.objects[0].state = belief::TrackState::kUnseen;
    for (int frame = 0; frame < 60; ++frame) {
      filter::RobotBounds bounds;
      const auto report =
          filter::predict(belief, {}, {}, 1.0 / 30.0, {},
                          {backends.simulator_factory(), bounds, {1, core::Purpose::kProcessNoise}, pool});
      EXPECT_EQ(report.not_simulated, 0) << report.failure;
      ++belief.step;
    }
    for (const belief::Particle& particle : belief.objects[0].particles)
      EXPECT_NEAR(particle.X_WO.translation.z(), lowest + 0.06, 0.04) << lowest;  // on a face, an edge or a corner
    EXPECT_EQ(belief.lowest_seen, lowest);
  }
}

/// More objects that may touch than the lockstep stepper takes, one of them falling on the others.
std::string many_boxes() {
  std::string text = R"(name: boxes
duration: 0.4
models:
  box: {box: [0.1, 0.08, 0.06], mass: 0.4}
supports:
  table: {box: [1.6, 1.6, 0.04], pose: {position: [0, 0, -0.02]}}
objects:
  falling: {model: box, pose: {position: [0, 0, 0.12]}}
)";
  for (int i = 0; i < 16; ++i)
    text += "  box" + std::to_string(i) + ": {model: box, pose: {position: [" +
            std::to_string(0.103 * (i % 4) - 0.1545) + ", " + std::to_string(0.083 * (i / 4) - 0.1245) + ", 0.03]}}\n";
  return text + R"(camera:
  width: 80
  height: 60
  fov_deg: 55
  look: {from: [0.6, -0.5, 0.6], at: [0, 0, 0.05]}
)";
}

class FailingPhysics : public ::testing::Test {
 protected:
  FailingPhysics() : path_(folder_.path() / "run.mcap") {
    const std::string text = many_boxes();
    const auto scene = load_scene_text(text, "boxes.yaml", {});
    EXPECT_TRUE(scene.ok()) << scene.status().message();
    scene_ = *scene;
    const core::Status recorded = tests::record_scene(text, {"boxes.yaml", text, 1, ""}, 15.0, path_);
    EXPECT_TRUE(recorded.ok()) << recorded.message();
  }
  std::vector<TrackerStep> tracked_with(Stepper stepper) {
    BackendSettings settings;
    settings.stepper = stepper;
    Backends backends(pool_, settings);
    const auto tracker = Tracker::create(scene_, {}, 1, backends);
    EXPECT_TRUE(tracker.ok()) << tracker.status().message();
    std::vector<TrackerStep> steps;
    const auto summary = replay_recording(path_, {}, **tracker, {}, {},
                                          [&](const TrackerStep& step, const Tracker&) {
                                            steps.push_back(step);
                                            return core::ok_status();
                                          },
                                          {});
    EXPECT_TRUE(summary.ok()) << summary.status().message();
    return steps;
  }

  const tests::ScratchDir folder_;
  std::filesystem::path path_;
  core::ThreadPool pool_{1};
  std::shared_ptr<const belief::Scene> scene_;
};

TEST_F(FailingPhysics, IsToldInTheRecordOfEachStepThatItWasMissingIn) {
  const auto steps = tracked_with(Stepper::kLockstep);  // which refuses so many
  ASSERT_GE(steps.size(), 4u);
  int without = 0;
  for (const TrackerStep& step : steps) {
    if (step.counters.not_simulated == 0) {
      EXPECT_THAT(step.record.degraded, IsEmpty());
      continue;
    }
    ++without;
    EXPECT_THAT(step.record.degraded, Contains(HasSubstr("physics failed")));
    EXPECT_THAT(step.record.degraded, Contains(HasSubstr("the scene has 17")));
    EXPECT_THAT(step.physics_failure, HasSubstr("the scene has 17"));
  }
  EXPECT_GT(without, 1);
}

TEST_F(FailingPhysics, IsNotToldWhereNothingFailed) {
  int simulated = 0;
  for (const TrackerStep& step : tracked_with(Stepper::kAutomatic)) {
    EXPECT_THAT(step.record.degraded, IsEmpty());
    EXPECT_EQ(step.counters.not_simulated, 0);
    simulated += step.counters.simulated;
  }
  EXPECT_GT(simulated, 0);
}

}  // namespace
}  // namespace prescene::service::tracked_physics_test
