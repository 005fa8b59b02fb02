// SPDX-License-Identifier: Apache-2.0
// A start that is one object in flight: nothing touches before it opens, its moments are those of free fall, and what
// is held, pushed or of several components counts as it should.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/outcomes/common_flight.h"
#include "tests/support/simple_scenes.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::tests {
namespace {

using simulation::CommonFlight;
using simulation::FlightBodies;

struct Flown {
  CommonFlight flight;
  double first_contact = 1e300;  ///< Of 500 instances with any but a robot's body, s.
};

Flown flown(const std::shared_ptr<const Scene>& scene, const simulation::StartDistribution& starts, int threads = 2) {
  simulation::ShapeStore shapes;
  core::ThreadPool pool(threads);
  const core::RandomStream stream(1, core::Purpose::kStartBelief);
  const simulation::SimulatorFactory make = [&](const Scene& asked, double) {
    return simulation::make_bullet_simulator(asked, shapes, {});
  };
  simulation::RunRequest request;
  request.actions = scene->actions;
  request.stop.duration = scene->duration;
  const auto bodies = FlightBodies::make(*scene, shapes);
  EXPECT_TRUE(bodies.ok());
  auto flight = simulation::common_flight(*scene, *bodies, starts, request, make, stream, pool);
  EXPECT_TRUE(flight.ok());
  Flown found{*std::move(flight)};

  std::vector<WorldState> states;
  for (const simulation::StartSampler& sampler : simulation::samplers_of(starts, stream))
    for (std::uint32_t i = 0; i < 500; ++i) states.push_back(sampler.draw(i));
  request.stop.duration = std::min(scene->duration, found.flight.apart_until + 0.2);
  std::vector<belief::Trajectory> runs(states.size());
  (*make(*scene, 1.0))->run(states, request, stream, 0, pool, runs);
  const auto robot = static_cast<int>(scene->objects.size() + scene->supports.size());
  for (const belief::Trajectory& run : runs)
    for (const belief::ContactInterval& contact : run.contacts)
      if (contact.second < robot) found.first_contact = std::min(found.first_contact, contact.begin);
  return found;
}
Flown flown(const std::shared_ptr<const Scene>& scene) { return flown(scene, simulation::start_of(scene)); }

belief::NormalPose normal_pose(const Vector3d& position, const Vector3d& deviations) {
  belief::NormalPose pose;
  pose.mean = Pose::from_translation(position);
  pose.covariance.diagonal().tail<3>() = deviations.cwiseAbs2();
  return pose;
}

std::shared_ptr<Scene> falling_ball(double height, double deviation) {
  auto scene = std::make_shared<Scene>(floor_scene(primitive_model("ball", geometry::Sphere{0.03})));
  scene->objects[0].pose = normal_pose({0.0, 0.0, height}, Vector3d::Constant(deviation));
  scene->duration = 3.0;
  return scene;
}

TEST(FlightBodies, GrownSpheresCoverTheBody) {
  Scene scene;
  add_object(scene, primitive_model("box", geometry::BoxShape{{0.2, 0.07, 0.1}}), "box");
  add_object(scene, primitive_model("can", geometry::Cylinder{0.03, 0.12}), "can");
  add_object(scene, primitive_model("cone", geometry::Cone{0.04, 0.1}), "cone");
  const auto carton =
      std::make_shared<const geometry::TriangleMesh>(geometry::make_gable_carton(0.07, 0.07, 0.165, 0.2));
  add_object(scene, model_of("carton", {belief::MeshShape{carton, Pose{}}}), "carton");
  simulation::ShapeStore shapes;
  const auto bodies = FlightBodies::make(scene, shapes);
  ASSERT_TRUE(bodies.ok());
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const geometry::TriangleMesh mesh = belief::collision_mesh(scene.models[i].collision);
    const FlightBodies::Object& body = bodies->object(i);
    double worst = -1.0, farthest = 0.0;
    for (const geometry::SurfacePoint& on : geometry::sample_surface(mesh, 4000, 7)) {
      double nearest = 1e300;
      for (const auto& sphere : body.parts.at(0)->packing().spheres())
        nearest =
            std::min(nearest, (sphere.centre.cast<double>() - on.position).norm() - static_cast<double>(sphere.radius));
      worst = std::max(worst, nearest);
      farthest = std::max(farthest, (on.position - body.middle).norm());
    }
    EXPECT_LT(body.margin, 0.003) << scene.objects[i].name;
    EXPECT_LT(worst, 0.0) << scene.objects[i].name;
    EXPECT_LE(farthest, static_cast<double>(body.ball->packing().spheres()[0].radius));
  }
}

TEST(CommonFlight, NothingTouchesBefore) {
  for (const NamedScene& named : uncertain_scenes()) {
    if (named.name == "D") continue;  // stands from the start
    const Flown found = flown(named.scene);
    EXPECT_LE(found.flight.apart_until, found.first_contact) << named.name;
    EXPECT_GE(found.flight.apart_until, 0.5 * found.first_contact - 1.0 / 60.0) << named.name;
    ASSERT_FALSE(found.flight.openings.empty());
    EXPECT_EQ(found.flight.openings[0].first, 0);
  }
}

TEST(CommonFlight, WhatStandsIsOpenFromTheStart) {
  const auto stack = std::make_shared<const Scene>(shoved_stack());
  const Flown found = flown(stack);
  EXPECT_EQ(found.flight.apart_until, 0.0);
  ASSERT_EQ(found.flight.openings.size(), 2U);  // the upper box on the lower one, that on the table
  for (const auto& opening : found.flight.openings) EXPECT_GT(opening.probability, 0.99);
}

TEST(CommonFlight, ABallFallsForAsLongAsGravitySays) {
  const double height = 0.5;
  const Flown found = flown(falling_ball(height, 0.0));
  const double falls = std::sqrt(2.0 * (height - 0.03) / kG);
  EXPECT_LE(found.flight.apart_until, falls);
  EXPECT_GT(found.flight.apart_until, falls - 2.0 / 60.0);

  // Wider starts open earlier, by some 4.5 deviations of the height.
  const Flown wide = flown(falling_ball(height, 0.02));
  const double early = std::sqrt(2.0 * (height - 0.03 - 4.45 * 0.02) / kG);
  EXPECT_LT(wide.flight.apart_until, falls - 1.0 / 60.0);
  EXPECT_NEAR(wide.flight.apart_until, early, 2.0 / 60.0);
}

TEST(CommonFlight, AHandGoesWhereWhatItHoldsHasIt) {
  // It puts a can to a known place, and stands the more aside the more the can is aside in it: a ball that it would
  // pass by 3 cm is in its way in 7 of 100 draws.
  auto scene = std::make_shared<Scene>();
  scene->gravity_W.setZero();
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision = {belief::PrimitiveShape{geometry::Sphere{0.02}, Pose{}}};
  hand.timeline = {{0.0, Pose{}}};
  scene->robot = {hand};
  add_object(*scene, primitive_model("can", geometry::Sphere{0.02}), "can");
  add_object(*scene, primitive_model("ball", geometry::Sphere{0.02}), "ball");
  const double deviation = 0.02, reach = 0.04, aside = 0.07, height = 0.5;
  scene->objects[0].pose = normal_pose({0.15, 0.0, 0.0}, {0.0, deviation, 0.0});
  scene->objects[0].held_by = "hand";
  scene->objects[1].pose = belief::FixedPose{Pose::from_translation({0.0, aside, height})};
  belief::Transport transport;
  transport.object = "can";
  transport.X_WO = belief::FixedPose{Pose::from_translation({0.15, 0.0, height})};
  transport.duration = 1.0;
  scene->actions = {{0.0, transport}};
  scene->duration = 1.5;
  const Flown found = flown(scene);
  EXPECT_EQ(found.flight.end, belief::FlightEnd::kMayTouch);
  ASSERT_EQ(found.flight.openings.size(), 1U);
  EXPECT_EQ(found.flight.openings[0].first, 1);
  EXPECT_EQ(found.flight.openings[0].second, 2);
  // In a way of t, a can that was at y leaves the hand at (0, -y t, height t).
  double first = 1e300;
  for (double y = -3.0 * deviation; y <= 3.0 * deviation; y += 0.1 * deviation)
    for (double t = 0.0; t <= 1.0; t += 1e-3)
      if (std::hypot(aside + y * t, height - height * t) < reach) first = std::min(first, t);
  EXPECT_LE(found.flight.apart_until, first);
  EXPECT_GT(found.flight.apart_until, first - 0.1);
  // One whose place in the hand is known passes.
  scene->objects[0].pose = belief::FixedPose{Pose::from_translation({0.15, 0.0, 0.0})};
  EXPECT_EQ(flown(scene).flight.end, belief::FlightEnd::kRunEnds);
}

TEST(CommonFlight, MomentsAreThoseOfFreeFall) {
  auto scene = falling_ball(0.8, 0.01);
  scene->objects[0].twist.linear.x = belief::NormalScalar{0.5, 0.1};
  const Flown found = flown(scene);
  const collision::UncertainPose& moments = found.flight.moments.at(0).at(0);
  const double interval = 1.0 / 60.0, middle = found.flight.apart_until + 0.5 * interval;
  EXPECT_NEAR(moments.X_WB.translation.x(), 0.5 * middle, 2e-3);
  // Both ends of a look together: half an interval of mean motion on either side.
  const double moved = 0.5 * 0.5 * interval;
  const double variance = 1e-4 + 0.01 * middle * middle + moved * moved;
  EXPECT_NEAR(moments.covariance(3, 3), variance, 0.1 * variance);
  EXPECT_NEAR(moments.covariance(4, 4), 1e-4, 1e-5);
}

TEST(CommonFlight, ComponentsCountByTheirWeights) {
  const std::shared_ptr<const Scene> near = falling_ball(0.1, 1e-4), far = falling_ball(0.5, 1e-4);
  simulation::StartDistribution starts;
  starts.components = {simulation::start_of(near).components[0], simulation::start_of(far).components[0]};
  starts.components[0].weight = 1.0;
  starts.components[1].weight = 3.0;
  const Flown both = flown(near, starts), alone = flown(near);
  EXPECT_EQ(both.flight.apart_until, alone.flight.apart_until);
  EXPECT_NEAR(both.flight.openings.at(0).probability, 0.25 * alone.flight.openings.at(0).probability, 0.03);
  EXPECT_EQ(both.flight.moments.size(), 2U);
}

TEST(CommonFlight, WhatHoldsAnObjectDoesNotTouchIt) {
  auto scene = falling_ball(0.5, 0.0);
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision = {belief::PrimitiveShape{geometry::BoxShape{{0.1, 0.1, 0.02}}, Pose{}}};
  hand.timeline = {{0.0, Pose::from_translation({0.0, 0.0, 0.538})}};
  scene->robot.push_back(hand);
  EXPECT_EQ(flown(scene).flight.apart_until, 0.0);  // it touches the ball

  scene->objects[0].held_by = "hand";
  belief::Release release;
  release.object = "object";
  scene->actions = {{0.3, release}};
  const Flown found = flown(scene);
  const double lands = 0.3 + std::sqrt(2.0 * 0.47 / kG);
  EXPECT_LE(found.flight.apart_until, lands);
  EXPECT_GT(found.flight.apart_until, lands - 2.0 / 60.0);
  EXPECT_EQ(found.flight.openings.at(0).second, 1);  // the floor

  belief::Push push;
  push.from = {-1.0, 0.0, 0.03};
  push.to = {1.0, 0.0, 0.03};
  scene->actions.insert(scene->actions.begin(), {0.2, push});
  const Flown pushed = flown(scene);
  EXPECT_NEAR(pushed.flight.apart_until, 0.2, 1e-9);
  EXPECT_TRUE(pushed.flight.openings.empty());
}

TEST(CommonFlight, TheSameForAnyNumberOfThreads) {
  const auto scene = std::make_shared<const Scene>(carton_over_bin());
  const CommonFlight one = flown(scene, simulation::start_of(scene), 1).flight;
  const CommonFlight two = flown(scene, simulation::start_of(scene), 2).flight;
  EXPECT_EQ(one.apart_until, two.apart_until);
  ASSERT_EQ(one.openings.size(), two.openings.size());
  for (std::size_t i = 0; i < one.openings.size(); ++i)
    EXPECT_EQ(one.openings[i].probability, two.openings[i].probability);
}

TEST(CommonFlight, SaysWhyItEnds) {
  using belief::FlightEnd;
  EXPECT_EQ(flown(falling_ball(1.0, 0.01)).flight.end, FlightEnd::kMayTouch);
  const auto end_of = [](const std::shared_ptr<Scene>& scene) {
    const CommonFlight flight = flown(scene).flight;
    EXPECT_TRUE(flight.openings.empty());
    return flight.end;
  };
  auto brief = falling_ball(2.0, 0.01);
  brief->duration = 0.2;
  EXPECT_EQ(end_of(brief), FlightEnd::kRunEnds);
  brief->duration = 0.01;  // less than a look
  EXPECT_EQ(end_of(brief), FlightEnd::kRunEnds);
  auto pushed = falling_ball(2.0, 0.01);
  pushed->actions = {{0.1, belief::Push{{1.0, 0.0, 1.0}, {1.1, 0.0, 1.0}}}};
  EXPECT_EQ(end_of(pushed), FlightEnd::kPush);
  auto endless = falling_ball(2.0, 0.01);
  endless->supports[0].X_WS.translation.z() = -2000.0;
  endless->duration = 30.0;
  EXPECT_EQ(end_of(endless), FlightEnd::kNotFollowed);
}

TEST(CommonFlight, IsOpenedByWhatARobotTouchesBetweenTheMiddlesOfLooks) {
  // A plate comes to the falling ball at 3 m/s, as far as the end of a look, and goes back.
  auto scene = falling_ball(2.0, 1e-4);
  belief::KinematicBody plate;
  plate.name = "plate";
  plate.collision = {belief::PrimitiveShape{geometry::BoxShape{{0.01, 0.2, 1.0}}, Pose{}}};
  const double when = 10.0 / 60.0;
  plate.timeline = {{0.0, Pose::from_translation({0.53, 0.0, 2.0})},
                    {when, Pose::from_translation({0.03, 0.0, 2.0})},
                    {2.0 * when, Pose::from_translation({0.53, 0.0, 2.0})}};
  scene->robot.push_back(plate);
  const CommonFlight flight = flown(scene).flight;
  EXPECT_NEAR(flight.apart_until, when - 1.0 / 60.0, 1e-9);
  ASSERT_FALSE(flight.openings.empty());
  EXPECT_EQ(flight.openings[0].second, 2);
}

}  // namespace
}  // namespace prescene::tests
