// SPDX-License-Identifier: Apache-2.0
// What predict() lets a simulator move, with what, and what it says of runs that fail.
#include <gmock/gmock.h>

#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "predict_fixture.h"
#include "tests/support/fake_simulator.h"
#include "tests/support/matchers.h"

namespace prescene::filter_tests {
namespace {

using belief::MotionMode;
using belief::Particle;

TEST_F(Predict, FallsByTheSimulatorWhereThereIsOne) {
  // Physics that moves everything down by a tenth of the duration and knows where the hand goes.
  int scenes = 0;
  const simulation::SimulatorFactory source = [&](const belief::Scene& scene, double step_factor) {
    ++scenes;
    EXPECT_EQ(step_factor, 1.0);
    EXPECT_EQ(scene.robot[0].timeline.size(), 2u);
    EXPECT_NEAR(scene.robot[0].timeline.back().X_WG.translation.z(), 0.45, 1e-12);
    return by_formula([](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
      belief::WorldState end = start;
      end.objects[0].X_WO.translation.z() -= 0.1 * request.stop.duration;
      end.objects[0].V_WO.linear.z() = -0.1;
      return end;
    });
  };
  belief::Belief belief = hand_and_object(MotionMode::kMoving, false);
  for (Particle& particle : belief.objects[0].particles) particle.V_WO.linear.x() = 0.05;
  PredictOptions options = without_mode_changes();
  options.physics_share = 0.5;
  const PredictReport report = run(belief, Pose::from_translation({0.1, 0.0, 0.45}), 0.1, options, {}, source);
  EXPECT_EQ(scenes, 1);
  int fell = 0;
  for (const Particle& particle : belief.objects[0].particles) {
    const bool by_physics = particle.V_WO.linear.z() == -0.1;
    fell += by_physics;
    EXPECT_NEAR(particle.X_WO.translation.z(), by_physics ? 0.29 : 0.3, 1e-12);
  }
  EXPECT_GT(fell, 2);
  EXPECT_LT(fell, 14);
  EXPECT_EQ(report.simulated, fell);
  EXPECT_EQ(report.not_simulated, 0);
  EXPECT_EQ(report.failure, "");
}

/// A belief whose particles all fly, each at a speed of its own, and are all to be moved by physics.
belief::Belief flying() {
  belief::Belief belief = hand_and_object(MotionMode::kMoving, false);
  belief.objects[0].state = belief::TrackState::kTracked;
  for (std::size_t i = 0; i < belief.objects[0].particles.size(); ++i) {
    belief.objects[0].particles[i].V_WO.linear = Vector3d(0.3, 0.02 * static_cast<double>(i), 0.1);
    belief.objects[0].particles[i].V_WO.angular = Vector3d(0.5, -0.2, 1.0);
  }
  return belief;
}

PredictOptions all_by_physics() {
  PredictOptions options = without_mode_changes();
  options.physics_share = 1.0;
  return options;
}

TEST_F(Predict, WithoutASimulatorParticlesGoOnAtConstantVelocity) {
  belief::Belief belief = flying(), without = flying();
  const PredictReport report =
      run(belief, belief.robot[0], 0.1, all_by_physics(), {},
          [](const belief::Scene&, double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
            return core::unsupported("box: a surface can't move");
          });
  EXPECT_EQ(report.simulated, 0);
  EXPECT_EQ(report.not_simulated, 16);
  EXPECT_NE(report.failure.find("box: a surface can't move"), std::string::npos) << report.failure;
  const PredictReport none = run(without, without.robot[0], 0.1, all_by_physics());
  EXPECT_EQ(none.not_simulated, 0);
  EXPECT_EQ(belief, without);
  for (std::size_t i = 0; i < 16; ++i) {
    const Vector3d expected = Vector3d(0.1, 0.0, 0.3) + 0.1 * Vector3d(0.3, 0.02 * static_cast<double>(i), 0.1);
    EXPECT_THAT(belief.objects[0].particles[i].X_WO.translation, tests::is_near(expected, 1e-12)) << i;
  }
}

/// Spoils every other run of a simulator that moves everything down by 5 cm.
class SpoilingSimulator final : public simulation::Simulator {
 public:
  using Spoil = std::function<void(belief::Trajectory&)>;
  explicit SpoilingSimulator(Spoil spoil) : spoil_(std::move(spoil)) {}
  void run(std::span<const belief::WorldState> starts, const simulation::RunRequest& request,
           const core::RandomStream& stream, simulation::InstanceNumbers numbers, core::ThreadPool& pool,
           std::span<belief::Trajectory> runs, const core::Cancellation* cancellation) const override {
    const tests::FakeSimulator down(
        [](const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) {
          belief::WorldState end = start;
          end.objects[0].X_WO.translation.z() -= 0.05;
          return end;
        });
    down.run(starts, request, stream, numbers, pool, runs, cancellation);
    for (std::size_t i = 1; i < runs.size(); i += 2) spoil_(runs[i]);
  }
  std::unique_ptr<simulation::Instance> make_instance(const std::vector<belief::Action>&,
                                                      const core::RandomStream&) const override {
    return nullptr;
  }

 private:
  Spoil spoil_;
};

TEST_F(Predict, RunsThatDoNotLastLeaveTheirParticlesAtConstantVelocity) {
  const auto ends_with = [](belief::TrajectoryEnd end) { return [end](belief::Trajectory& run) { run.end = end; }; };
  const std::pair<SpoilingSimulator::Spoil, std::string> spoils[] = {
      {ends_with(belief::TrajectoryEnd::kDiverged), "diverged"},
      {ends_with(belief::TrajectoryEnd::kLeftTheWorld), "left"},
      {ends_with(belief::TrajectoryEnd::kAtRest), "ended"},
      {ends_with(belief::TrajectoryEnd::kCancelled), "ended"},
      {ends_with(belief::TrajectoryEnd::kDecided), "ended"},
      {[](belief::Trajectory& run) { run.states.clear(); }, "no end"},
      {[](belief::Trajectory& run) { run.states.back().objects.clear(); }, "no end"},
      {[](belief::Trajectory& run) { run.states.back().objects[0].X_WO.translation.y() = std::nan(""); }, "finite"},
      {[](belief::Trajectory& run) { run.states.back().objects[0].V_WO.angular.x() = INFINITY; }, "finite"}};
  belief::Belief without = flying();
  run(without, without.robot[0], 0.1, all_by_physics());
  for (const auto& [spoil, word] : spoils) {
    SCOPED_TRACE(word);
    belief::Belief belief = flying();
    const PredictReport report =
        run(belief, belief.robot[0], 0.1, all_by_physics(), {},
            [&spoil = spoil](const belief::Scene&, double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
              return std::unique_ptr<simulation::Simulator>(std::make_unique<SpoilingSimulator>(spoil));
            });
    EXPECT_EQ(report.simulated, 8);
    EXPECT_EQ(report.not_simulated, 8);
    EXPECT_NE(report.failure.find("'box'"), std::string::npos) << report.failure;
    EXPECT_NE(report.failure.find(word), std::string::npos) << report.failure;
    for (std::size_t i = 0; i < 16; ++i) {
      const Particle& particle = belief.objects[0].particles[i];
      if (i % 2 == 1) {
        EXPECT_EQ(particle, without.objects[0].particles[i]) << i;
      } else {
        EXPECT_NEAR(particle.X_WO.translation.z(), 0.25, 1e-12) << i;
      }
    }
  }
}

TEST_F(Predict, ASimulatorIsMadeOnceThoughRunsDifferInLength) {
  belief::Belief belief = hand_and_object(MotionMode::kMoving, true);
  for (std::size_t i = 0; i < 8; ++i) belief.objects[0].particles[i].mode = MotionMode::kHeld;
  PredictOptions options = all_by_physics();
  options.regrasp_probability = 0.0;
  belief::Control control;
  control.actions.push_back({0.04, belief::Release{"box"}});
  int made = 0;
  std::mutex mutex;
  std::multiset<int> milliseconds;
  const PredictReport report = run(belief, belief.robot[0], 0.1, options, control, [&](const belief::Scene&, double) {
    ++made;
    return by_formula([&](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
      const std::lock_guard lock(mutex);
      milliseconds.insert(static_cast<int>(std::lround(1e3 * request.stop.duration)));
      return start;
    });
  });
  EXPECT_EQ(made, 1);
  EXPECT_EQ(report.simulated, 16);
  EXPECT_EQ(milliseconds.count(60), 8u);   // let go after 40 ms
  EXPECT_EQ(milliseconds.count(100), 8u);  // had slipped before
}

/// A belief of which all particles rest in view, and physics in which the hand takes along what stands in its way.
belief::Belief resting_in_view() {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  belief.objects[0].state = belief::TrackState::kTracked;
  return belief;
}
simulation::SimulatorFactory taking_along(double speed) {
  return [speed](const belief::Scene&, double) {
    return by_formula(
        [speed](const belief::WorldState& start, const simulation::RunRequest& request, core::RandomStream) {
          belief::WorldState end = start;
          end.objects[0].V_WO.linear = Vector3d(speed, 0.0, -0.01);  // and settles a little
          end.objects[0].X_WO.translation += request.stop.duration * end.objects[0].V_WO.linear;
          return end;
        });
  };
}

TEST_F(Predict, OfWhatRestsInViewPhysicsTakesAShareAlongWithARobotBody) {
  belief::Belief belief = resting_in_view();
  const belief::Belief before = belief;
  const PredictReport report =
      run(belief, Pose::from_translation({0.15, 0.0, 0.4}), 0.1, without_mode_changes(), {}, taking_along(0.5));
  int taken = 0;
  for (std::size_t i = 0; i < belief.objects[0].particles.size(); ++i) {
    const Particle& particle = belief.objects[0].particles[i];
    if (particle.mode == MotionMode::kResting) {
      EXPECT_EQ(particle.X_WO.translation, before.objects[0].particles[i].X_WO.translation);
      continue;
    }
    ++taken;
    EXPECT_NEAR(particle.X_WO.translation.x(), 0.15, 1e-12);
    EXPECT_EQ(particle.V_WO.linear.x(), 0.5);
  }
  EXPECT_GT(taken, 2) << "the frame decides between what is taken along ...";
  EXPECT_LT(taken, 14) << "... and what is not";
  EXPECT_EQ(report.pushed, taken);
}

TEST_F(Predict, WhatIsSetInMotionOutOfSightIsCounted) {
  for (const double speed : {0.5, 0.0}) {
    belief::Belief belief = resting_in_view();
    belief.objects[0].state = belief::TrackState::kUnseen;
    const PredictReport report =
        run(belief, Pose::from_translation({0.15, 0.0, 0.4}), 0.1, without_mode_changes(), {}, taking_along(speed));
    const auto all = static_cast<int>(belief.objects[0].particles.size());
    EXPECT_EQ(report.simulated, all);
    EXPECT_EQ(report.pushed, speed > 0.0 ? all : 0);
  }
}

TEST_F(Predict, WhatRestsInViewStaysWhereNothingPushesIt) {
  // Near the hand physics finds that it stays; far from it nothing is simulated; and neither where no body moves.
  struct Case {
    Pose X_WG;
    double speed;
    bool is_simulated;
  };
  for (const Case& c : {Case{Pose::from_translation({0.15, 0.0, 0.4}), 0.0, true},
                        Case{Pose::from_translation({0.1, 0.0, 0.4}), 0.5, false}}) {
    belief::Belief belief = resting_in_view();
    const PredictReport report = run(belief, c.X_WG, 0.1, without_mode_changes(), {}, taking_along(c.speed));
    EXPECT_EQ(report.simulated > 0, c.is_simulated);
    for (const Particle& particle : belief.objects[0].particles) {
      EXPECT_EQ(particle.mode, MotionMode::kResting);
      EXPECT_EQ(particle.X_WO.translation, Vector3d(0.1, 0.0, 0.3));
    }
  }
  belief::Belief belief = resting_in_view();
  belief.robot = {Pose::from_translation({0.1, 0.0, 3.0})};
  const PredictReport report =
      run(belief, Pose::from_translation({0.15, 0.0, 3.0}), 0.1, without_mode_changes(), {}, taking_along(0.5));
  EXPECT_EQ(report.simulated, 0);
}

/// Only what may touch within the step is simulated together: three boxes, two side by side and one far away.
TEST_F(Predict, SimulatesObjectsWithThoseThatTheyMayTouch) {
  belief::Belief belief = hand_and_object(MotionMode::kMoving, false);
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  const double places[] = {0.1, 0.1 + 0.065, 2.0};
  belief.objects.resize(3, belief.objects[0]);
  scene->objects.resize(3, scene->objects[0]);
  for (std::size_t i = 0; i < 3; ++i) {
    belief.objects[i].name = scene->objects[i].name = "box_" + std::to_string(i);
    belief.objects[i].island = static_cast<int>(i);
    for (Particle& particle : belief.objects[i].particles) {
      particle.X_WO.translation.x() = places[i];
      particle.V_WO.linear.x() = 0.05;  // faster than what may be still
    }
  }
  belief.scene = scene;
  std::vector<std::vector<std::string>> groups;
  const simulation::SimulatorFactory simulators = [&](const belief::Scene& of, double) {
    std::vector<std::string>& names = groups.emplace_back();
    for (const belief::SceneObject& object : of.objects) names.push_back(object.name);
    return by_formula(
        [](const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) { return start; });
  };
  PredictOptions options = without_mode_changes();
  options.physics_share = 1.0;
  const PredictReport report = run(belief, belief.robot[0], 0.04, options, {}, simulators);
  EXPECT_EQ(report.simulated, 48);
  const std::vector<std::vector<std::string>> expected = {{"box_0", "box_1"}, {"box_2"}};
  EXPECT_EQ(groups, expected);
}

}  // namespace
}  // namespace prescene::filter_tests
