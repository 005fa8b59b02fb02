// SPDX-License-Identifier: Apache-2.0
// What was seen to lie still starts flush with what is below it, however uncertain its pose: on a table, on a slope and
// on another object.
#include <gtest/gtest.h>

#include <cmath>

#include "prescene/geometry/angles.h"
#include "prescene/queries/query_engine.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "tests/queries/sliding_scene.h"

namespace prescene::queries::seating_test {
namespace {

using geometry::Pose;
using geometry::Vector3d;

/// A box of 10 x 8 x 6 cm on a support that is tilted by an angle, and another one on top of it. Their poses are known
/// to 2 mm and 0.05 rad.
belief::Belief stack(double tilt, int still_frames) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "stack";
  scene->models = {tests::box_model("box", {0.10, 0.08, 0.06})};
  scene->models[0].contact.friction = belief::FixedScalar{0.9};
  belief::Support table;
  table.name = "table";
  table.collision.push_back(
      belief::PrimitiveShape{geometry::BoxShape{{1.0, 1.0, 0.04}}, Pose::from_translation({0.0, 0.0, -0.02})});
  table.X_WS.rotation = geometry::exp_rotation({0.0, tilt, 0.0});
  table.contact.friction = belief::FixedScalar{1.0};
  scene->supports.push_back(table);
  belief::Belief belief;
  belief.seed = 5;
  belief.step = 20;
  for (int i = 0; i < 2; ++i) {
    belief::SceneObject in_scene;
    belief::ObjectBelief object;
    in_scene.name = object.name = i == 0 ? "lower" : "upper";
    scene->objects.push_back(in_scene);
    belief::Particle particle;
    particle.X_WO = table.X_WS * Pose::from_translation({0.0, 0.0, 0.03 + 0.06 * i});
    particle.covariance.diagonal().head<3>().setConstant(0.05 * 0.05);
    particle.covariance.diagonal().segment<3>(3).setConstant(0.002 * 0.002);
    particle.mode = belief::MotionMode::kResting;
    object.particles = {particle};
    object.motion.X_still = particle.X_WO;
    object.motion.still_frames = still_frames;
    belief.objects.push_back(object);
  }
  belief.scene = scene;
  return belief;
}

double stays(const belief::Belief& belief, const std::string& object) {
  core::ThreadPool pool(2);
  static simulation::ShapeStore shapes;
  QueryContext context;
  context.pool = &pool;
  context.make_simulator = [](const belief::Scene& scene, double) {
    return simulation::make_bullet_simulator(scene, shapes);
  };
  belief::StabilityQuery query;
  query.object = object;
  query.max_move = 0.01;
  query.max_turn = 2.0 * geometry::kDegree;
  query.duration = 1.0;
  const belief::Answer answer = queries::answer(belief, {"", query}, context);
  EXPECT_TRUE(answer.error.ok()) << answer.error.message();
  return std::get<belief::StabilityAnswer>(answer.what).stable.probability;
}

TEST(Seating, WhatLiesStillStays) {
  for (const double tilt : {0.0, 15.0 * geometry::kDegree})
    for (const char* object : {"lower", "upper"}) EXPECT_GT(stays(stack(tilt, 30), object), 0.97) << object << tilt;
}

TEST(Seating, WhatMayMoveStartsWhereItIsDrawn) { EXPECT_LT(stays(stack(0.0, 3), "lower"), 0.5); }

TEST(Seating, WhatHasNothingBelowFalls) {
  belief::Belief belief = stack(0.0, 30);
  for (belief::ObjectBelief& object : belief.objects)
    object.particles[0].X_WO.translation.z() = object.motion.X_still.translation.z() += 0.2;
  EXPECT_LT(stays(belief, "lower"), 0.03);
}

}  // namespace
}  // namespace prescene::queries::seating_test
