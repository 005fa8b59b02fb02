// SPDX-License-Identifier: Apache-2.0
// A hand and an object whose particles are moved forward by predict().
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>

#include "filter_fixture.h"
#include "prescene/filter/operators/predict.h"
#include "tests/support/fake_simulator.h"

namespace prescene::filter_tests {

/// A scene of a hand and an object; all particles alike.
inline belief::Belief hand_and_object(belief::MotionMode mode, bool held) {
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
    belief::Particle particle;
    particle.log_weight = -std::log(16.0);
    particle.X_WO = Pose::from_translation({0.1, 0.0, 0.3});
    particle.covariance = 1e-6 * belief::Matrix12d::Identity();
    particle.mode = mode;
    object.particles.push_back(particle);
  }
  belief.objects.push_back(object);
  return belief;
}

inline PredictOptions without_mode_changes() {
  PredictOptions options;
  options.wake_probability = 0.0;
  options.settle_probability = 0.0;
  return options;
}

inline core::Result<std::unique_ptr<simulation::Simulator>> by_formula(tests::FakeSimulator::Formula formula) {
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

}  // namespace prescene::filter_tests
