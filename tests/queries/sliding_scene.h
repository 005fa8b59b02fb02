// SPDX-License-Identifier: Apache-2.0
// A carton on a table that slides a metre along x when its friction is below a threshold: outcomes of known
// probability.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "prescene/belief/belief.h"
#include "prescene/core/random.h"
#include "prescene/queries/query_engine.h"
#include "tests/support/fake_simulator.h"

namespace prescene::tests {

inline constexpr double kSlideBelow = 0.45;

inline belief::ObjectModel box_model(const std::string& name, const geometry::Vector3d& size) {
  belief::ObjectModel model;
  model.name = name;
  model.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{size}, {}});
  model.mass = belief::FixedScalar{0.5};
  return *belief::with_derived_properties(model);
}

inline belief::Condition moved() { return {belief::MovedMoreThan{0.5}}; }

inline std::shared_ptr<belief::Scene> sliding_scene() {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "sliding";
  scene->models = {box_model("carton", {0.07, 0.07, 0.2}), box_model("cup", {0.05, 0.05, 0.05})};
  scene->models[0].contact.friction = belief::NormalScalar{0.5, 0.1, 0.0, 1.0};
  belief::Support table;
  table.name = "table";
  table.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{2.0, 2.0, 0.1}}, {}});
  table.X_WS = geometry::Pose::from_translation({0.0, 0.0, -0.05});
  scene->supports.push_back(table);
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision.push_back(belief::PrimitiveShape{geometry::Sphere{0.02}, {}});
  hand.timeline = {{0.0, geometry::Pose::from_translation({0.0, 0.0, 0.4})}};
  scene->robot.push_back(hand);
  belief::SceneObject carton;
  carton.name = "carton";
  carton.model = 0;
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance.diagonal() << 0.0, 0.0, 0.01, 1e-4, 4e-4, 0.0;
  carton.pose = belief::NormalPose{geometry::Pose::from_translation({0.0, 0.0, 0.1}), covariance};
  scene->objects.push_back(carton);
  belief::SceneObject cup;
  cup.name = "cup";
  cup.model = 1;
  cup.pose = belief::FixedPose{geometry::Pose::from_translation({0.3, 0.3, 0.025})};
  scene->objects.push_back(cup);
  belief::SceneCamera camera;
  camera.intrinsics = {80, 60, 70.0, 70.0, 39.5, 29.5};
  // Looks straight down from 1.5 m; image right is W's x.
  camera.X_WC = {geometry::Quaterniond(0.0, 1.0, 0.0, 0.0), {0.0, 0.0, 1.5}};
  scene->camera = camera;
  scene->duration = 2.0;
  scene->exclusive_outcomes.push_back({"end", {{"slides", "carton", {moved()}}}});
  scene->outcomes.push_back({"cup moves", "cup", {moved()}});
  return scene;
}

/// Of the friction's prior, cut to [0, 1].
inline double slide_probability() {
  const auto cdf = [](double x) { return core::normal_cdf((x - 0.5) / 0.1); };
  return (cdf(kSlideBelow) - cdf(0.0)) / (cdf(1.0) - cdf(0.0));
}

inline belief::WorldState slide(const belief::WorldState& start, const simulation::RunRequest&, core::RandomStream) {
  belief::WorldState end = start;
  if (start.objects[0].physical.friction < kSlideBelow) end.objects[0].X_WO.translation.x() += 1.0;
  return end;
}

inline queries::QueryContext context_with(const FakeSimulator::Formula& formula, core::ThreadPool& pool) {
  queries::QueryContext context;
  context.pool = &pool;
  context.make_simulator = [formula](const belief::Scene&,
                                     double) -> core::Result<std::unique_ptr<simulation::Simulator>> {
    return std::unique_ptr<simulation::Simulator>(std::make_unique<FakeSimulator>(formula));
  };
  return context;
}

/// A belief over the sliding scene: the carton with two hypotheses of its pose of weights 0.25 and 0.75 and two of its
/// friction of the same weights, of which the lighter is slippery; the cup certain.
inline belief::Belief two_hypotheses() {
  belief::Belief belief;
  belief.step = 17;
  belief.seed = 3;
  belief.scene = sliding_scene();
  belief.robot = {geometry::Pose::from_translation({0.2, 0.0, 0.3})};
  belief.X_WC = belief.scene->camera->X_WC;
  belief::Particle light;
  light.log_weight = std::log(0.25);
  light.X_WO = geometry::Pose::from_translation({0.1, 0.0, 0.1});
  light.covariance.diagonal().segment<3>(3).setConstant(1e-6);
  belief::Particle heavy = light;
  heavy.log_weight = std::log(0.75);
  heavy.X_WO.translation.x() = 0.12;
  belief::ObjectBelief carton;
  carton.name = "carton";
  carton.model = 0;
  carton.particles = {light, heavy};
  // Frictions of about 0.27 and 0.73.
  const std::vector<belief::PhysicalDraw> draws = {{{0.01}, std::log(0.25)}, {{0.99}, std::log(0.75)}};
  carton.physics.draws = std::make_shared<const std::vector<belief::PhysicalDraw>>(draws);
  carton.physics.lessons = 1;
  belief::ObjectBelief cup;
  cup.name = "cup";
  cup.model = 1;
  belief::Particle there;
  there.X_WO = geometry::Pose::from_translation({0.3, 0.3, 0.025});
  cup.particles = {there};
  belief.objects = {carton, cup};
  return belief;
}

}  // namespace prescene::tests
