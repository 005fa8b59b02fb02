// SPDX-License-Identifier: Apache-2.0
// Steps that are taken without looking for contacts leave the same bits as steps that look and find none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "bullet_scenes.h"
#include "prescene/geometry/sampling.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::tests {
namespace {

struct Runs {
  std::vector<belief::Trajectory> all;
  double seconds = 0.0, flown = 0.0;
};

Runs run_all(const Scene& scene, const std::vector<WorldState>& starts, bool skip_flight, double sample_interval) {
  BulletOptions options;
  options.skip_flight = skip_flight;
  const auto simulator = simulator_of(scene, options);
  simulation::RunRequest request;
  request.actions = scene.actions;
  request.stop.duration = 2.5;
  request.sample_interval = sample_interval;
  core::ThreadPool pool(1);
  Runs runs;
  runs.all.resize(starts.size());
  simulator->run(starts, request, core::RandomStream(5, core::Purpose::kAction), 0, pool, runs.all);
  for (belief::Trajectory& run : runs.all) {
    runs.seconds += run.simulated_seconds;
    runs.flown += std::exchange(run.flown_seconds, 0.0);
  }
  return runs;
}

void expect_the_same_bits(const Scene& scene, const std::vector<WorldState>& starts, double least_share) {
  for (const double interval : {0.0, 0.05}) {
    const Runs stepped = run_all(scene, starts, false, interval);
    const Runs skipped = run_all(scene, starts, true, interval);
    EXPECT_EQ(skipped.all, stepped.all) << scene.name;
    EXPECT_EQ(stepped.flown, 0.0);
    EXPECT_GT(skipped.flown, interval > 0.0 ? -1.0 : least_share * skipped.seconds) << scene.name;
  }
}

std::vector<WorldState> drawn_starts(const Scene& scene, int count) {
  core::RandomStream stream(3, core::Purpose::kTest);
  std::vector<double> uniforms(static_cast<std::size_t>(belief::start_dimensions(scene)));
  std::vector<WorldState> starts;
  for (int i = 0; i < count; ++i) {
    for (double& u : uniforms) u = stream.uniform();
    starts.push_back(belief::draw_start(scene, uniforms));
  }
  return starts;
}

TEST(Flight, SkippingItKeepsEveryBitOfTheUncertainScenes) {
  const std::map<std::string, double> least_share = {{"A", 0.1}, {"B", 0.01}, {"C", 0.2}, {"D", -1.0}};
  for (const NamedScene& named : uncertain_scenes())
    expect_the_same_bits(*named.scene, drawn_starts(*named.scene, 100), least_share.at(named.name));
}

/// A ball and a box thrown across each other's way, an off-centre club, a bin of triangles and a hand that opens late.
Scene crossing_scene() {
  Scene scene;
  scene.name = "crossing";
  scene.supports.push_back(floor_support());
  const auto bin = std::make_shared<const geometry::TriangleMesh>(geometry::make_open_bin({0.3, 0.3, 0.2}, 0.01));
  scene.supports.push_back(support_of("bin", {belief::MeshShape{bin, Pose{}, belief::MeshUse::kSurface}}, Pose{}));
  add_object(scene, primitive_model("ball", geometry::Sphere{0.03}), "ball");
  add_object(scene, primitive_model("box", geometry::BoxShape{{0.1, 0.05, 0.02}}), "box");
  ObjectModel club = primitive_model("club", geometry::Cylinder{0.02, 0.3});
  club.center_of_mass = belief::Vector3Distribution::fixed({0.0, 0.005, 0.1});
  add_object(scene, club, "club");
  for (belief::ObjectModel& model : scene.models) model.contact.restitution = belief::FixedScalar{0.5};
  return scene;
}

TEST(Flight, SkippingItKeepsEveryBitWhereThingsMeetInTheAir) {
  const Scene scene = crossing_scene();
  std::vector<WorldState> starts;
  core::RandomStream stream(7, core::Purpose::kTest);
  for (int i = 0; i < 100; ++i) {
    WorldState start = belief::mean_start(scene);
    for (std::size_t k = 0; k < start.objects.size(); ++k) {
      belief::ObjectState& object = start.objects[k];
      const double side = k == 1 ? 1.0 : -1.0;
      object.X_WO.translation = Vector3d(0.5 * side, 0.3 * static_cast<double>(k), 0.6 + 0.1 * stream.uniform());
      object.X_WO.rotation = geometry::uniform_rotation(stream);
      object.V_WO.linear =
          Vector3d(-1.5 * side, -0.6 * static_cast<double>(k), 2.0) + 0.2 * geometry::normal_vector(stream);
      object.V_WO.angular = 6.0 * geometry::normal_vector(stream);
    }
    starts.push_back(start);
  }
  expect_the_same_bits(scene, starts, 0.01);
  // They do meet: with each other and with what is fixed.
  int between_objects = 0;
  for (const belief::Trajectory& run : run_all(scene, starts, true, 0.0).all)
    for (const belief::ContactInterval& contact : run.contacts) between_objects += contact.second < 3;
  EXPECT_GT(between_objects, 10);
}

TEST(Flight, WhatLeavesTheWorldOrHoversEndsAlike) {
  Scene scene;
  scene.name = "away";
  add_object(scene, primitive_model("box", geometry::BoxShape{{0.1, 0.05, 0.02}}), "box");
  WorldState start = belief::mean_start(scene);
  start.objects[0].V_WO.linear = {9.0, 0.0, 4.0};
  start.objects[0].V_WO.angular = {1.0, 20.0, 1.0};
  expect_the_same_bits(scene, {start}, 0.5);
  scene.gravity_W.setZero();
  start.objects[0].V_WO.angular.setZero();
  for (const double speed : {0.0, 0.01, 0.019, 0.021, 1.0}) {
    start.objects[0].V_WO.linear = {speed, 0.0, 0.0};
    expect_the_same_bits(scene, {start}, -1.0);
  }
}

TEST(Flight, SkippingItKeepsEveryBitAroundAHandThatLetsGo) {
  Scene scene;
  scene.name = "let_go";
  scene.supports.push_back(floor_support());
  add_object(scene, primitive_model("box", geometry::BoxShape{{0.06, 0.05, 0.04}}), "box");
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{{0.08, 0.08, 0.02}}, Pose{}});
  hand.timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.5})}, {0.2, Pose::from_translation({0.3, 0.0, 0.6})}};
  scene.robot.push_back(hand);
  scene.objects[0].held_by = "hand";
  belief::Release release;
  release.object = "box";
  release.retreat = {0.0, 0.0, 0.2};
  release.retreat_duration = 0.05;
  scene.actions.push_back({0.18, release});
  WorldState start = belief::mean_start(scene);
  start.objects[0].X_WO.translation = {0.0, 0.0, 0.47};
  expect_the_same_bits(scene, {start}, 0.05);
}

}  // namespace
}  // namespace prescene::tests
