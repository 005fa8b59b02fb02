// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/predict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <set>

#include "filter_fixture.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/fake_simulator.h"
#include "tests/support/matchers.h"

namespace prescene::filter_tests {
namespace {

using belief::MotionMode;
using belief::Particle;

/// A scene of a hand and an object; all particles alike.
belief::Belief hand_and_object(MotionMode mode, bool held) {
  belief::Scene scene =
      *table_scene({box_model("box", {0.06, 0.10, 0.18})}, {Pose::from_translation({0.1, 0.0, 0.3})}, 0.001, 0.001);
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{Vector3d(0.1, 0.1, 0.02)}, Pose::identity()});
  hand.timeline = {{0.0, Pose::from_translation({0.1, 0.0, 0.4})}};
  scene.robot.push_back(hand);
  if (held) scene.objects[0].held_by = "hand";
  belief::Belief belief;
  belief.scene = std::make_shared<const belief::Scene>(scene);
  belief.robot = {hand.timeline[0].X_WG};
  belief.seed = 3;
  belief.step = 1;
  belief::ObjectBelief object;
  object.name = "box";
  for (int i = 0; i < 16; ++i) {
    Particle particle;
    particle.log_weight = -std::log(16.0);
    particle.X_WO = Pose::from_translation({0.1, 0.0, 0.3});
    particle.covariance = 1e-6 * belief::Matrix12d::Identity();
    particle.mode = mode;
    object.particles.push_back(particle);
  }
  belief.objects.push_back(object);
  return belief;
}

TEST(RobotBounds, AreThoseOfTheShapesThatABodyHasNow) {
  const auto box = [](double half, const Vector3d& at) {
    return belief::PrimitiveShape{geometry::BoxShape{Vector3d::Constant(2.0 * half)}, Pose::from_translation(at)};
  };
  RobotBounds bounds;
  EXPECT_TRUE(bounds.of(3, {}).isEmpty());
  for (const double half : {0.1, 0.1, 0.2}) {
    const geometry::Box& one = bounds.of(0, {box(half, {1.0, 0.0, 0.0}), box(half, {0.0, 0.0, 2.0})});
    EXPECT_LT((one.min() - Vector3d::Constant(-half)).norm(), 1e-12);
    EXPECT_LT((one.max() - Vector3d(1.0 + half, half, 2.0 + half)).norm(), 1e-12);
  }
  EXPECT_LT((bounds.of(1, {box(0.3, Vector3d::Zero())}).max() - Vector3d::Constant(0.3)).norm(), 1e-12);
  EXPECT_LT((bounds.of(0, {box(0.3, Vector3d::Zero())}).min() + Vector3d::Constant(0.3)).norm(), 1e-12);
  EXPECT_TRUE(bounds.of(3, {}).isEmpty());
}

PredictOptions without_mode_changes() {
  PredictOptions options;
  options.wake_probability = 0.0;
  options.settle_probability = 0.0;
  return options;
}

core::Result<std::unique_ptr<simulation::Simulator>> by_formula(tests::FakeSimulator::Formula formula) {
  return std::unique_ptr<simulation::Simulator>(std::make_unique<tests::FakeSimulator>(std::move(formula)));
}

class Predict : public ::testing::Test {
 protected:
  PredictReport run(belief::Belief& belief, const Pose& X_WG, double dt, const PredictOptions& options,
                    const belief::Control& control = {}, const simulation::SimulatorFactory& simulators = {}) {
    const Pose poses[] = {X_WG};
    return predict(belief, control, poses, dt, options, {simulators, bounds_, stream_, threads_});
  }
  const core::RandomStream stream_{3, core::Purpose::kProcessNoise};
  RobotBounds bounds_;
  core::ThreadPool threads_{2};
};

TEST_F(Predict, RestingStaysWhereItIsAndGrowsALittleUnsure) {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  const belief::Belief before = belief;
  run(belief, before.robot[0], 0.04, without_mode_changes());
  for (std::size_t i = 0; i < 16; ++i) {
    const Particle& particle = belief.objects[0].particles[i];
    EXPECT_EQ(particle.X_WO, before.objects[0].particles[i].X_WO);
    EXPECT_EQ(particle.log_weight, before.objects[0].particles[i].log_weight);
    EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + 0.0001 * 0.0001 * 0.04, 1e-15);
    EXPECT_EQ(particle.covariance(9, 9), 1e-6);
  }
}

TEST_F(Predict, WhatWakesWeighsAsMuchAsThingsBeginToMove) {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  PredictOptions options;
  const double dt = 0.05;
  double moving_weight = 0.0, sum = 0.0;
  int woken = 0;
  constexpr int kSteps = 200;
  for (int step = 0; step < kSteps; ++step) {
    belief::Belief next = belief;
    next.step = belief.step + static_cast<std::uint64_t>(step);
    run(next, belief.robot[0], dt, options);
    int mine = 0;
    for (const Particle& particle : next.objects[0].particles) {
      const bool moves = particle.mode == MotionMode::kMoving;
      mine += moves;
      moving_weight += moves ? std::exp(particle.log_weight) : 0.0;
      sum += std::exp(particle.log_weight);
    }
    // Some of them in every frame, whatever the chance.
    EXPECT_GE(mine, 5) << step;
    EXPECT_LE(mine, 6) << step;
    woken += mine;
  }
  EXPECT_NEAR(sum, kSteps, 1e-9);
  EXPECT_NEAR(woken / (16.0 * kSteps), 3.0 * options.wake_probability, 0.01);
  EXPECT_NEAR(moving_weight / kSteps, dt / 5.0, 0.05 * dt / 5.0);  // once in five seconds
}

TEST_F(Predict, WhatNothingNewIsSeenOfKeepsItsModesAndWeights) {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  for (std::size_t i = 0; i < 8; ++i) belief.objects[0].particles[i].mode = MotionMode::kMoving;
  const Pose X_WG = belief.robot[0], poses[] = {X_WG};
  const std::vector<bool> keeps = {true};
  for (int step = 0; step < 100; ++step) {
    ++belief.step;
    predict(belief, {}, poses, 1.0 / 30.0, {}, {{}, bounds_, stream_, threads_}, {}, keeps);
  }
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(belief.objects[0].particles[i].mode, i < 8 ? MotionMode::kMoving : MotionMode::kResting) << i;
    EXPECT_EQ(belief.objects[0].particles[i].log_weight, -std::log(16.0)) << i;
  }
}

TEST_F(Predict, InAHandThatStandsStillItIsStill) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  const Pose X_WG = belief.robot[0];
  run(belief, X_WG, 0.04, without_mode_changes());
  for (const Particle& particle : belief.objects[0].particles)
    EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + 0.0001 * 0.0001 * 0.04, 1e-15);
  run(belief, X_WG * Pose::from_translation({0.001, 0.0, 0.0}), 0.04, without_mode_changes());
  for (const Particle& particle : belief.objects[0].particles)
    EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + (0.0001 * 0.0001 + 0.01 * 0.01) * 0.04, 1e-12);
}

TEST_F(Predict, HiddenRestingIsForgottenNoFasterThanItMayCreep) {
  // A minute of frames in which it is not seen: only the random walk remains.
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  belief.objects[0].state = belief::TrackState::kUnseen;
  for (int i = 0; i < 1800; ++i) run(belief, belief.robot[0], 1.0 / 30.0, without_mode_changes());
  for (const Particle& particle : belief.objects[0].particles)
    EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + 0.0006 * 0.0006 * 60.0, 1e-9);
}

TEST_F(Predict, WhatIsHiddenAndStaysByPhysicsIsForgottenNoFasterThanWhatRests) {
  for (const double shift : {0.0, 0.02}) {  // m, by which physics moves it in each step
    const simulation::SimulatorFactory source = [&](const belief::Scene&, double) {
      return by_formula([=](const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) {
        belief::WorldState end = start;
        end.objects[0].X_WO.translation.x() += shift;
        return end;
      });
    };
    belief::Belief belief = hand_and_object(MotionMode::kMoving, false);
    belief.objects[0].state = belief::TrackState::kUnseen;
    for (int i = 0; i < 20; ++i) run(belief, belief.robot[0], 0.1, without_mode_changes(), {}, source);
    for (const Particle& particle : belief.objects[0].particles) {
      if (shift > 0.0) {
        EXPECT_GT(particle.covariance(3, 3), 1e-3);
      } else {
        EXPECT_NEAR(particle.covariance(3, 3), 1e-6 + 0.0006 * 0.0006 * 2.0, 1e-9);
      }
    }
  }
}

TEST_F(Predict, AVelocityThatAgreesWithNoneSettlesAndIsNotSimulated) {
  int simulated = 0;
  const simulation::SimulatorFactory source = [&](const belief::Scene&, double) {
    ++simulated;
    return by_formula(
        [](const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) { return start; });
  };
  PredictOptions options = without_mode_changes();
  options.physics_share = 1.0;
  options.settle_probability = 1.0;
  for (const double deviation : {0.01, 0.1}) {  // of the velocity, which is 10 cm/s
    belief::Belief belief = hand_and_object(MotionMode::kMoving, false);
    for (Particle& particle : belief.objects[0].particles) {
      particle.V_WO.linear.x() = 0.1;
      particle.covariance.bottomRightCorner<6, 6>() = deviation * deviation * geometry::Matrix6d::Identity();
    }
    run(belief, belief.robot[0], 0.04, options, {}, source);
    const MotionMode expected = deviation > 0.05 ? MotionMode::kResting : MotionMode::kMoving;
    for (const Particle& particle : belief.objects[0].particles) EXPECT_EQ(particle.mode, expected);
    EXPECT_EQ(simulated, 1);
  }
}

TEST_F(Predict, HeldMovesRigidlyWithItsHand) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  const Pose X_GO = belief.robot[0].inverse() * belief.objects[0].particles[0].X_WO;
  Pose X_WG = belief.robot[0];
  X_WG.rotation = geometry::exp_rotation({0.2, 0.1, -0.3});
  X_WG.translation += Vector3d(0.03, 0.02, -0.01);
  run(belief, X_WG, 0.1, without_mode_changes());
  for (const Particle& particle : belief.objects[0].particles) {
    EXPECT_THAT(particle.X_WO, tests::is_near(X_WG * X_GO, 1e-9, 1e-9));
    EXPECT_EQ(particle.mode, MotionMode::kHeld);
    // The twist is that of the motion over the step.
    EXPECT_THAT(Vector3d(0.1 * particle.V_WO.angular), tests::is_near(Vector3d(0.2, 0.1, -0.3), 1e-9));
  }
  EXPECT_EQ(belief.robot[0], X_WG);
}

TEST_F(Predict, ReleasedLeavesTheHandAtItsTimeWithTheHandsVelocity) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  const Pose X_WG = Pose::from_translation({0.2, 0.0, 0.4});  // 1 m/s along x
  belief::Control control;
  control.actions.push_back({0.04, belief::Release{"box"}});
  PredictOptions options = without_mode_changes();
  options.velocity_keep = options.unseen_velocity_keep = 1.0;
  run(belief, X_WG, 0.1, options, control);
  for (const Particle& particle : belief.objects[0].particles) {
    EXPECT_EQ(particle.mode, MotionMode::kMoving);
    EXPECT_NEAR(particle.V_WO.linear.x(), 1.0, 1e-9);
    EXPECT_NEAR(particle.X_WO.translation.x(), 0.2, 1e-9);
    EXPECT_GT(particle.covariance(9, 9), options.wake_speed * options.wake_speed);
  }
}

TEST_F(Predict, GraspedFollowsTheHandAndTheOldSceneKeepsItsWord) {
  belief::Belief belief = hand_and_object(MotionMode::kResting, false);
  const auto scene_before = belief.scene;
  belief::Control control;
  control.actions.push_back({0.0, belief::Grasp{"box", "hand"}});
  run(belief, Pose::from_translation({0.1, 0.0, 0.5}), 0.1, without_mode_changes(), control);
  EXPECT_FALSE(scene_before->objects[0].held_by.has_value());
  EXPECT_EQ(belief.scene->objects[0].held_by, "hand");
  EXPECT_NEAR(belief.objects[0].particles[0].X_WO.translation.z(), 0.4, 1e-9);
}

TEST_F(Predict, ReleasedIsHeldByNobody) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  const auto scene_before = belief.scene;
  belief::Control control;
  control.actions.push_back({0.04, belief::Release{"box"}});
  run(belief, Pose::from_translation({0.0, 0.0, 0.4}), 0.1, without_mode_changes(), control);
  EXPECT_EQ(scene_before->objects[0].held_by, "hand");
  EXPECT_FALSE(belief.scene->objects[0].held_by.has_value());
}

TEST_F(Predict, WhatIsLetGoAndGraspedAgainIsHeld) {
  belief::Belief belief = hand_and_object(MotionMode::kHeld, true);
  belief::Control control;
  control.actions.push_back({0.02, belief::Release{"box"}});
  control.actions.push_back({0.04, belief::Grasp{"box", "hand"}});
  run(belief, Pose::from_translation({0.0, 0.0, 0.4}), 0.1, without_mode_changes(), control);
  EXPECT_EQ(belief.scene->objects[0].held_by, "hand");
  EXPECT_EQ(belief.objects[0].particles[0].mode, MotionMode::kHeld);
}

TEST_F(Predict, AHandThatHasNotLetGoCarriesOnWhatSeemedToSlip) {
  PredictOptions options = without_mode_changes();
  options.regrasp_probability = 1.0;
  for (const bool held : {true, false}) {
    belief::Belief belief = hand_and_object(MotionMode::kMoving, held);
    run(belief, Pose::from_translation({0.0, 0.0, 0.4}), 0.1, options);
    for (const Particle& particle : belief.objects[0].particles)
      EXPECT_EQ(particle.mode, held ? MotionMode::kHeld : MotionMode::kMoving);
  }
}

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

TEST_F(Predict, SomeRestingParticlesWakeAndSlowOnesSettle) {
  belief::Belief resting = hand_and_object(MotionMode::kResting, false);
  belief::Belief moving = hand_and_object(MotionMode::kMoving, false);
  resting.objects[0].state = moving.objects[0].state = belief::TrackState::kTracked;
  int woken = 0, settled = 0;
  for (int i = 0; i < 50; ++i) {
    belief::Belief a = resting, b = moving;
    a.step = b.step = static_cast<std::uint64_t>(i);
    run(a, a.robot[0], 0.033, {});
    run(b, b.robot[0], 0.033, {});
    for (const Particle& particle : a.objects[0].particles) woken += particle.mode == MotionMode::kMoving;
    for (const Particle& particle : b.objects[0].particles) settled += particle.mode == MotionMode::kResting;
  }
  // 800 Bernoulli draws each; five standard deviations are 0.057 and 0.063.
  EXPECT_NEAR(woken / 800.0, 3.0 * PredictOptions().wake_probability, 0.058);
  EXPECT_NEAR(settled / 800.0, PredictOptions().settle_probability, 0.064);
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

TEST(Drift, TurnsAboutTheGivenPoint) {
  Particle particle;
  particle.X_WO.rotation = geometry::exp_rotation({0.3, -0.2, 0.5});
  const Vector3d p_OQ(0.0, 0.4, 0.1);
  const Vector3d p_WQ = particle.X_WO * p_OQ;
  // Q stands still while the body turns about it.
  particle.V_WO.angular = Vector3d(0.5, 1.0, -2.0);
  particle.V_WO = geometry::shifted(particle.V_WO, Vector3d::Zero());
  particle.V_WO.linear = -particle.V_WO.angular.cross(particle.X_WO.rotation * p_OQ);
  const geometry::Quaterniond before = particle.X_WO.rotation;
  drift(particle, p_OQ, 0.1, 1.0, {0.0, 0.0, 0.0, 0.0});
  EXPECT_THAT(Vector3d(particle.X_WO * p_OQ), tests::is_near(p_WQ, 1e-12));
  EXPECT_NEAR(geometry::angle_between(before, particle.X_WO.rotation), 0.1 * Vector3d(0.5, 1.0, -2.0).norm(), 1e-9);
  // And goes on standing still.
  EXPECT_THAT(geometry::shifted(particle.V_WO, particle.X_WO.rotation * p_OQ).linear,
              tests::is_near(Vector3d(0.0, 0.0, 0.0), 1e-12));
}

// The covariance of many drifted samples about the drifted mean, against the propagated one.
TEST(DriftStatistics, CovarianceIsThatOfDriftedSamples) {
  core::RandomStream stream(11, core::Purpose::kTest);
  Particle mean;
  mean.X_WO.rotation = geometry::exp_rotation({0.7, 0.1, -0.4});
  mean.X_WO.translation = Vector3d(0.1, 0.2, 0.3);
  mean.V_WO.linear = Vector3d(0.2, -0.1, 0.05);
  mean.covariance.diagonal() << Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(4e-6),
      Eigen::Vector3d::Constant(4e-2), Eigen::Vector3d::Constant(1e-2);
  const MotionNoise none{0.0, 0.0, 0.0, 0.0};
  Particle moved = mean;
  drift(moved, Vector3d::Zero(), 0.1, 0.8, none);
  using Vector12d = Eigen::Matrix<double, 12, 1>;
  belief::Matrix12d sampled = belief::Matrix12d::Zero();
  constexpr int kSamples = 4000;
  for (int i = 0; i < kSamples; ++i) {
    Particle sample = mean;
    Vector12d d;
    for (int k = 0; k < 12; ++k) d[k] = std::sqrt(mean.covariance(k, k)) * stream.normal();
    sample.X_WO = geometry::box_plus(mean.X_WO, d.head<6>());
    sample.V_WO.angular += d.segment<3>(6);
    sample.V_WO.linear += d.tail<3>();
    drift(sample, Vector3d::Zero(), 0.1, 0.8, none);
    Vector12d e;
    e.head<6>() = geometry::box_minus(sample.X_WO, moved.X_WO);
    e.segment<3>(6) = sample.V_WO.angular - moved.V_WO.angular;
    e.tail<3>() = sample.V_WO.linear - moved.V_WO.linear;
    sampled += e * e.transpose() / kSamples;
  }
  // A sample covariance of n draws is off by sqrt(2 / n) = 2.2 %; five of those.
  const Vector12d scale = moved.covariance.diagonal().cwiseSqrt();
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j)
      EXPECT_NEAR(sampled(i, j), moved.covariance(i, j), 0.12 * scale[i] * scale[j]) << i << ", " << j;
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
