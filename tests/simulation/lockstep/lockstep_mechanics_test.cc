// SPDX-License-Identifier: Apache-2.0
// The lockstep stepper against closed-form mechanics: the laws of tests/simulation/bullet/mechanics_test.cc with
// tolerances for single precision.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lockstep_scenes.h"
#include "tests/support/closed_forms.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;
using geometry::Capsule;
using geometry::Cylinder;
using geometry::Sphere;

TEST(LockstepMechanics, FreeFallIsAParabolaAtAnyStep) {
  for (const double step : {1.0 / 1000.0, 1.0 / 240.0, 1.0 / 60.0}) {
    const Scene scene = floor_scene(primitive_model("ball", Sphere{0.05}));
    LockstepOptions options;
    options.step = step;
    auto instance = lockstep_instance_of(scene, options);
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.1, -0.2, 5.0};
    start.objects[0].V_WO.linear = {0.7, -0.3, 1.1};
    instance->set_state(start);
    for (int n = 1; n <= 12; ++n) {
      instance->step();
      const double t = n * step;
      const auto object = instance->state().objects[0];
      const Vector3d expected =
          Vector3d(0.1, -0.2, 5.0) + t * Vector3d(0.7, -0.3, 1.1) - 0.5 * kG * t * t * Vector3d::UnitZ();
      EXPECT_LT((object.X_WO.translation - expected).norm(), 5e-6);
      EXPECT_LT((object.V_WO.linear - Vector3d(0.7, -0.3, 1.1 - kG * t)).norm(), 2e-6);
    }
  }
}

TEST(LockstepMechanics, TumblingKeepsItsAngularMomentumAndNearlyItsEnergy) {
  Scene scene = floor_scene(primitive_model("brick", BoxShape{{0.2, 0.1, 0.05}}));
  scene.gravity_W.setZero();
  auto instance = lockstep_instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0.0, 0.0, 3.0};
  // About the middle axis, almost: the unstable one, so that the rotation flips over and over.
  start.objects[0].V_WO.angular = {0.1, 12.0, 0.2};
  instance->set_state(start);
  const geometry::Matrix3d inertia = scene.models[0].unit_inertia;
  const auto momentum = [&](const belief::ObjectState& o) {
    const geometry::Matrix3d R = o.X_WO.rotation.toRotationMatrix();
    return Vector3d(R * inertia * R.transpose() * o.V_WO.angular);
  };
  const Vector3d L = momentum(start.objects[0]);
  const double energy = 0.5 * L.dot(start.objects[0].V_WO.angular);
  for (int n = 0; n < 2400; ++n) {
    instance->step();
    const belief::ObjectState o = instance->state().objects[0];
    ASSERT_LT((momentum(o) - L).norm(), 1e-3 * L.norm());
    ASSERT_NEAR(0.5 * momentum(o).dot(o.V_WO.angular), energy, 5e-3 * energy);
  }
}

Slide slide(double angle, double mu, const belief::CollisionShape& shape, double half_height) {
  const Scene scene = incline_scene(model_of("block", {shape}), half_height, angle, mu);
  return slide_for_a_second(*lockstep_instance_of(scene), scene);
}

TEST(LockstepMechanics, BlockSlidesOnAnInclineIffTanThetaExceedsMu) {
  const belief::CollisionShape box = belief::PrimitiveShape{BoxShape{{0.1, 0.1, 0.04}}, Pose{}};
  const belief::CollisionShape disc = belief::PrimitiveShape{Cylinder{0.05, 0.04}, Pose{}};
  const belief::CollisionShape hull = hull_of(geometry::make_mesh(BoxShape{{0.1, 0.1, 0.04}}));
  for (const belief::CollisionShape& shape : {box, disc, hull}) {
    for (const double degrees : {10.0, 20.0, 30.0}) {
      const double angle = degrees * kPi / 180.0;
      const double threshold = std::tan(angle);
      EXPECT_LT(std::abs(slide(angle, threshold + 5e-4, shape, 0.02).way), 2e-5) << degrees;
      EXPECT_GT(slide(angle, threshold - 5e-4, shape, 0.02).way, 1e-3) << degrees;
    }
  }
}

TEST(LockstepMechanics, SlidingBlockReachesItsSpeed) {
  const belief::CollisionShape box = belief::PrimitiveShape{BoxShape{{0.1, 0.1, 0.04}}, Pose{}};
  for (const double mu : {0.0, 0.1, 0.3}) {
    const double angle = 25.0 * kPi / 180.0;
    const double acceleration = kG * (std::sin(angle) - mu * std::cos(angle));
    const Slide s = slide(angle, mu, box, 0.02);
    EXPECT_NEAR(s.speed, acceleration, 1e-3 * acceleration) << mu;
    EXPECT_NEAR(s.way, 0.5 * acceleration, 6e-3 * acceleration) << mu;
  }
}

TEST(LockstepMechanics, SlidingFrictionStopsABlockWhereItShould) {
  // In a direction that suits neither axis: the cone is round.
  for (const double heading : {0.0, 0.3, 0.7854}) {
    ObjectModel block = primitive_model("block", BoxShape{{0.1, 0.1, 0.04}});
    block.contact.friction = belief::FixedScalar{0.25};
    const Scene scene = floor_scene(block);
    auto instance = lockstep_instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.02};
    start.objects[0].V_WO.linear = {std::cos(heading), std::sin(heading), 0.0};
    instance->set_state(start);
    step_for(*instance, 1.0);
    const belief::ObjectState end = instance->state().objects[0];
    EXPECT_NEAR(end.X_WO.translation.head<2>().norm(), 1.0 / (2.0 * 0.25 * kG), 3e-3) << heading;
    EXPECT_NEAR(std::atan2(end.X_WO.translation.y(), end.X_WO.translation.x()), heading, 1e-4);
    EXPECT_LT(end.V_WO.linear.norm(), 1e-5);
  }
}

TEST(LockstepMechanics, RestingBlocksDoNotCreep) {
  const belief::CollisionShape box = belief::PrimitiveShape{BoxShape{{0.1, 0.1, 0.04}}, Pose{}};
  // A second on 20 degrees with friction to spare moved it by less than 20 um above; and a minute of it is no farther.
  Scene scene;
  scene.name = "incline";
  const Quaterniond tilt = about(Vector3d::UnitY(), 0.3);
  scene.supports.push_back(support_of("plank", {belief::PrimitiveShape{BoxShape{{10.0, 2.0, 0.1}}, Pose{}}},
                                      Pose{tilt, tilt * Vector3d(0.0, 0.0, -0.05)}));
  add_object(scene, model_of("block", {box}), "block");
  auto instance = lockstep_instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO = Pose{tilt, tilt * Vector3d(0.0, 0.0, 0.02)};
  instance->set_state(start);
  step_for(*instance, 60.0);
  EXPECT_LT((instance->state().objects[0].X_WO.translation - start.objects[0].X_WO.translation).norm(), 1e-4);
  EXPECT_TRUE(instance->at_rest());
}

TEST(LockstepMechanics, BallReboundsToItsRestitutionSquared) {
  for (const double step : {1.0 / 240.0, 1.0 / 1000.0}) {
    for (const double e : {0.3, 0.5, 0.7, 0.9}) {
      // Sixteen phases of the step, since the ball meets the floor anywhere within it.
      double worst = 0.0;
      for (int phase = 0; phase < 16; ++phase) {
        ObjectModel ball = primitive_model("ball", Sphere{0.03});
        ball.contact.restitution = belief::FixedScalar{e};
        const Scene scene = floor_scene(ball);
        LockstepOptions options;
        options.step = step;
        auto instance = lockstep_instance_of(scene, options);
        const double fall = 0.5 + 0.0007 * phase;
        WorldState start = start_of(scene);
        start.objects[0].X_WO.translation = {0.0, 0.0, 0.03 + fall};
        instance->set_state(start);
        double top = 0.0;
        bool rising = false;
        for (int n = 0; n < static_cast<int>(1.2 / step); ++n) {
          instance->step();
          const belief::ObjectState o = instance->state().objects[0];
          if (o.V_WO.linear.z() > 0.0) rising = true;
          if (rising) top = std::max(top, o.X_WO.translation.z() - 0.03);
          if (rising && o.V_WO.linear.z() < 0.0) break;
        }
        worst = std::max(worst, std::abs(top / (e * e * fall) - 1.0));
      }
      EXPECT_LT(worst, step < 2e-3 ? 0.04 : 0.15) << "e " << e << " step " << step;
    }
  }
}

TEST(LockstepMechanics, BallRollsDownAnInclineWithFiveSeventhsOfTheAcceleration) {
  Scene scene;
  scene.name = "incline";
  const double angle = 15.0 * kPi / 180.0;
  const Quaterniond tilt = about(Vector3d::UnitY(), angle);
  scene.supports.push_back(support_of("plank", {belief::PrimitiveShape{BoxShape{{10.0, 2.0, 0.1}}, Pose{}}},
                                      Pose{tilt, tilt * Vector3d(0.0, 0.0, -0.05)}));
  ObjectModel ball = primitive_model("ball", Sphere{0.04});
  ball.contact.friction = belief::FixedScalar{0.8};
  add_object(scene, ball, "ball");
  auto instance = lockstep_instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = tilt * Vector3d(0.0, 0.0, 0.04);
  instance->set_state(start);
  step_for(*instance, 1.0);
  const belief::ObjectState end = instance->state().objects[0];
  const double speed = 5.0 / 7.0 * kG * std::sin(angle);
  EXPECT_NEAR(end.V_WO.linear.norm(), speed, 1e-3 * speed);
  EXPECT_NEAR(end.V_WO.angular.norm(), speed / 0.04, 1e-3 * speed / 0.04);
}

TEST(LockstepMechanics, RollingFrictionStopsABallAsItsLeverArmSays) {
  // A lever arm b takes b g of each kilogram's moment: the ball slows by b g / (R + 2 R / 5) R ... = 5/7 b g / R.
  const double R = 0.04;
  const double b = 1e-3;
  ObjectModel ball = primitive_model("ball", Sphere{R});
  ball.contact.rolling_friction = b;
  const Scene scene = floor_scene(ball);
  auto instance = lockstep_instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0.0, 0.0, R};
  start.objects[0].V_WO.linear = {0.3, 0.0, 0.0};
  start.objects[0].V_WO.angular = {0.0, 0.3 / R, 0.0};
  instance->set_state(start);
  step_for(*instance, 1.0);
  EXPECT_NEAR(instance->state().objects[0].V_WO.linear.x(), 0.3 - 5.0 / 7.0 * b * kG / R, 3e-3);
  step_for(*instance, 1.5);
  EXPECT_LT(instance->state().objects[0].V_WO.linear.norm(), 1e-4);
}

TEST(LockstepMechanics, TiltedBoxTipsAtTheAngleOfItsDiagonal) {
  struct Case {
    double width, height;
    bool hull;
  };
  for (const Case c : {Case{0.06, 0.2, false}, Case{0.1, 0.1, false}, Case{0.12, 0.06, true}}) {
    const BoxShape box{{c.width, 0.08, c.height}};
    const belief::CollisionShape primitive = belief::PrimitiveShape{box, Pose{}};
    const Scene scene =
        floor_scene(model_of("box", {c.hull ? belief::CollisionShape(hull_of(geometry::make_mesh(box))) : primitive}));
    expect_tipping_at_the_diagonal(*lockstep_instance_of(scene), scene, c.width, c.height, 0.02, 0.1);
  }
}

/// On a table's face, about its edge, and on a hull.
TEST(LockstepMechanics, ShapesRestAtTheirTrueHeight) {
  struct Case {
    const char* name;
    belief::CollisionShape shape;
    double height;
  };
  const Pose lying{about(Vector3d::UnitX(), 0.5 * kPi), Vector3d::Zero()};
  const std::vector<Case> cases = {
      {"sphere", belief::PrimitiveShape{Sphere{0.05}, Pose{}}, 0.05},
      {"box", belief::PrimitiveShape{BoxShape{{0.1, 0.06, 0.04}}, Pose{}}, 0.02},
      {"thin plate", belief::PrimitiveShape{BoxShape{{0.1, 0.1, 0.001}}, Pose{}}, 0.0005},
      {"cylinder", belief::PrimitiveShape{Cylinder{0.03, 0.1}, Pose{}}, 0.05},
      {"cone", belief::PrimitiveShape{geometry::Cone{0.05, 0.1}, Pose{}}, 0.05},
      {"lying capsule", belief::PrimitiveShape{Capsule{0.02, 0.1}, lying}, 0.02},
      {"lying cylinder", belief::PrimitiveShape{Cylinder{0.03, 0.1}, lying}, 0.03},
      {"hull of a box", hull_of(geometry::make_mesh(BoxShape{{0.1, 0.06, 0.04}})), 0.02},
      {"hull of a carton", hull_of(geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2)), 0.1},
  };
  const BoxShape table{{1.0, 1.0, 0.1}};
  const belief::CollisionShape box = belief::PrimitiveShape{table, Pose{}};
  const belief::CollisionShape hull = hull_of(geometry::make_mesh(table));
  for (const Case& c : cases) {
    for (const bool on_hull : {false, true}) {
      for (const double x : {0.05, 0.485}) {
        Scene scene;
        scene.name = "table";
        scene.supports.push_back(support_of("table", {on_hull ? hull : box}, Pose::from_translation({0, 0, -0.05})));
        add_object(scene, model_of("thing", {c.shape}), "thing");
        auto instance = lockstep_instance_of(scene);
        WorldState start = start_of(scene);
        start.objects[0].X_WO.translation = {x, 0.1, c.height + 0.01};
        instance->set_state(start);
        step_for(*instance, 2.0);
        const belief::ObjectState end = instance->state().objects[0];
        EXPECT_NEAR(end.X_WO.translation.z(), c.height, 1e-4) << c.name << " at " << x << " on hull " << on_hull;
        EXPECT_NEAR((end.X_WO.rotation * Vector3d::UnitZ()).z(), 1.0, 1e-6) << c.name << " at " << x;
        EXPECT_LT(end.V_WO.linear.norm(), 1e-4) << c.name << " at " << x;
        EXPECT_TRUE(instance->at_rest()) << c.name << " at " << x << " on hull " << on_hull;
      }
    }
  }
}

TEST(LockstepMechanics, WhatMerelyBalancesIsNotAtRest) {
  const auto end_of = [](const geometry::Primitive& shape, const Pose& X_WO) {
    const Scene scene = floor_scene(primitive_model("thing", shape));
    WorldState start = start_of(scene);
    start.objects[0].X_WO = X_WO;
    simulation::RunRequest request;
    request.stop.duration = 0.5;
    return run_one(*lockstep_of(scene), start, request).end;
  };
  const Pose on_edge{about(Vector3d::UnitY(), 0.25 * kPi), {0, 0, 0.05 * std::sqrt(2.0) - 8e-5}};
  EXPECT_NE(end_of(BoxShape{{0.1, 0.1, 0.1}}, on_edge), belief::TrajectoryEnd::kAtRest);
  const Pose on_rim{about(Vector3d::UnitX(), 0.5 * kPi), {0, 0, 0.012}};
  EXPECT_NE(end_of(Cylinder{0.012, 0.00015}, on_rim), belief::TrajectoryEnd::kAtRest);
  const Pose on_tip{about(Vector3d::UnitX(), kPi), {0, 0, 0.05 - 2e-4 * (std::sqrt(5.0) - 1.0)}};
  EXPECT_NE(end_of(geometry::Cone{0.05, 0.1}, on_tip), belief::TrajectoryEnd::kAtRest);
  const Pose on_side{about(Vector3d::UnitX(), 0.5 * kPi), {0, 0, 0.03}};
  EXPECT_EQ(end_of(Cylinder{0.03, 0.2}, on_side), belief::TrajectoryEnd::kAtRest);
  EXPECT_EQ(end_of(Sphere{0.05}, Pose::from_translation({0, 0, 0.05})), belief::TrajectoryEnd::kAtRest);
}

TEST(LockstepMechanics, ContactsWithoutRoomAreCounted) {
  // Four corners a foot; there is room for 32.
  const auto on_feet = [](int feet) {
    std::vector<belief::CollisionShape> shapes;
    for (int i = 0; i < feet; ++i) {
      const Vector3d place(0.04 * (i % 4), 0.04 * (i / 4), 0.0);
      shapes.push_back(belief::PrimitiveShape{BoxShape{{0.02, 0.02, 0.1}}, Pose::from_translation(place)});
    }
    Scene scene = floor_scene(model_of("table", shapes));
    scene.objects[0].pose = belief::FixedPose{Pose::from_translation({0.0, 0.0, 0.05})};
    return scene;
  };
  simulation::RunRequest request;
  request.stop.duration = 0.1;
  request.stop.stop_at_rest = false;
  const auto dropped = [&](const Scene& scene, const simulation::Simulator& simulator) {
    return run_one(simulator, start_of(scene), request).dropped_contacts;
  };
  const Scene eight = on_feet(8), twelve = on_feet(12);
  EXPECT_EQ(dropped(eight, *lockstep_of(eight)), 0);
  EXPECT_EQ(dropped(twelve, *lockstep_of(twelve)), 24 * 16);  // each of the 24 steps
  EXPECT_EQ(dropped(twelve, *bullet_of(twelve)), 0);
}

TEST(LockstepMechanics, OverlapIsPushedOutGently) {
  // Started 3 mm deep, in a face and in an edge; and with the middle of the object inside.
  for (const double depth : {0.003, 0.03}) {
    for (const double x : {0.0, 0.5}) {
      Scene scene;
      scene.name = "table";
      scene.supports.push_back(support_of("table", {belief::PrimitiveShape{BoxShape{{1.0, 1.0, 0.2}}, Pose{}}},
                                          Pose::from_translation({0, 0, -0.1})));
      add_object(scene, primitive_model("box", BoxShape{{0.1, 0.06, 0.04}}), "box");
      auto instance = lockstep_instance_of(scene);
      WorldState start = start_of(scene);
      start.objects[0].X_WO.translation = {x == 0.0 ? 0.0 : 0.45, 0.1, 0.02 - depth};
      instance->set_state(start);
      double fastest = 0.0;
      for (int n = 0; n < 240; ++n) {
        instance->step();
        fastest = std::max(fastest, instance->state().objects[0].V_WO.linear.norm());
      }
      EXPECT_NEAR(instance->state().objects[0].X_WO.translation.z(), 0.02, 2e-4) << depth << " at " << x;
      EXPECT_LT(fastest, 0.1);
    }
  }
}

}  // namespace
}  // namespace prescene::tests
