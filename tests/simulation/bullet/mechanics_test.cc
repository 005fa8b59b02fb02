// SPDX-License-Identifier: Apache-2.0
// The simulator against closed-form mechanics.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bullet_scenes.h"
#include "tests/support/closed_forms.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;
using geometry::Capsule;
using geometry::Cone;
using geometry::Cylinder;
using geometry::Sphere;

TEST(Mechanics, FreeFallIsAnExactParabolaAtAnyStep) {
  for (const double step : {1.0 / 1000.0, 1.0 / 240.0, 1.0 / 60.0}) {
    Scene scene = floor_scene(primitive_model("ball", Sphere{0.05}));
    BulletOptions options;
    options.step = step;
    auto instance = instance_of(scene, options);
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
      EXPECT_LT((object.X_WO.translation - expected).norm(), 1e-12);
      EXPECT_LT((object.V_WO.linear - Vector3d(0.7, -0.3, 1.1 - kG * t)).norm(), 1e-12);
    }
  }
}

TEST(Mechanics, TumblingKeepsItsAngularMomentumAndNearlyItsEnergy) {
  Scene scene = floor_scene(primitive_model("brick", BoxShape{{0.2, 0.1, 0.05}}));
  scene.gravity_W.setZero();
  auto instance = instance_of(scene);
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
    ASSERT_LT((momentum(o) - L).norm(), 1e-10 * L.norm());
    ASSERT_NEAR(0.5 * momentum(o).dot(o.V_WO.angular), energy, 5e-3 * energy);
  }
}

Slide slide(double angle, double mu) {
  const Scene scene = incline_scene(primitive_model("block", BoxShape{{0.1, 0.1, 0.04}}), 0.02, angle, mu);
  return slide_for_a_second(*instance_of(scene), scene);
}

TEST(Mechanics, BlockSlidesOnAnInclineIffTanThetaExceedsMu) {
  for (const double degrees : {10.0, 20.0, 30.0}) {
    const double angle = degrees * kPi / 180.0;
    const double threshold = std::tan(angle);
    EXPECT_LT(std::abs(slide(angle, threshold + 5e-4).way), 1e-5) << degrees;
    EXPECT_GT(slide(angle, threshold - 5e-4).way, 1e-3) << degrees;
  }
}

TEST(Mechanics, SlidingBlockReachesItsSpeed) {
  for (const double mu : {0.0, 0.1, 0.3}) {
    const double angle = 25.0 * kPi / 180.0;
    const double acceleration = kG * (std::sin(angle) - mu * std::cos(angle));
    const Slide s = slide(angle, mu);
    EXPECT_NEAR(s.speed, acceleration, 1e-3 * acceleration) << mu;
    EXPECT_NEAR(s.way, 0.5 * acceleration, 6e-3 * acceleration) << mu;
  }
}

TEST(Mechanics, SlidingFrictionStopsABlockWhereItShould) {
  // In a direction that suits neither axis: the cone is round.
  for (const double heading : {0.0, 0.3, 0.7854}) {
    ObjectModel block = primitive_model("block", BoxShape{{0.1, 0.1, 0.04}});
    block.contact.friction = belief::FixedScalar{0.25};
    Scene scene = floor_scene(block);
    auto instance = instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.02};
    start.objects[0].V_WO.linear = {std::cos(heading), std::sin(heading), 0.0};
    instance->set_state(start);
    step_for(*instance, 1.0);
    const belief::ObjectState end = instance->state().objects[0];
    EXPECT_NEAR(end.X_WO.translation.head<2>().norm(), 1.0 / (2.0 * 0.25 * kG), 3e-3) << heading;
    EXPECT_NEAR(std::atan2(end.X_WO.translation.y(), end.X_WO.translation.x()), heading, 1e-6);
    EXPECT_LT(end.V_WO.linear.norm(), 1e-6);
  }
}

TEST(Mechanics, BallReboundsToItsRestitutionSquared) {
  for (const double step : {1.0 / 240.0, 1.0 / 1000.0}) {
    for (const double e : {0.3, 0.5, 0.7, 0.9}) {
      // Sixteen phases of the step, since the ball meets the floor anywhere within it.
      double worst = 0.0;
      for (int phase = 0; phase < 16; ++phase) {
        ObjectModel ball = primitive_model("ball", Sphere{0.03});
        ball.contact.restitution = belief::FixedScalar{e};
        Scene scene = floor_scene(ball);
        BulletOptions options;
        options.step = step;
        auto instance = instance_of(scene, options);
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
      RecordProperty("rebound_error", std::to_string(worst));
    }
  }
}

TEST(Mechanics, BallRollsDownAnInclineWithFiveSeventhsOfTheAcceleration) {
  Scene scene;
  scene.name = "incline";
  const double angle = 15.0 * kPi / 180.0;
  const Quaterniond tilt = about(Vector3d::UnitY(), angle);
  scene.supports.push_back(support_of("plank", {belief::PrimitiveShape{BoxShape{{10.0, 2.0, 0.1}}, Pose{}}},
                                      Pose{tilt, tilt * Vector3d(0.0, 0.0, -0.05)}));
  ObjectModel ball = primitive_model("ball", Sphere{0.04});
  ball.contact.friction = belief::FixedScalar{0.8};
  add_object(scene, ball, "ball");
  auto instance = instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = tilt * Vector3d(0.0, 0.0, 0.04);
  instance->set_state(start);
  step_for(*instance, 1.0);
  const belief::ObjectState end = instance->state().objects[0];
  const double speed = 5.0 / 7.0 * kG * std::sin(angle);
  EXPECT_NEAR(end.V_WO.linear.norm(), speed, 1e-3 * speed);
  EXPECT_NEAR(end.V_WO.angular.norm(), speed / 0.04, 1e-3 * speed / 0.04);
}

TEST(Mechanics, SlidingBallEndsUpRollingWithFiveSeventhsOfItsSpeed) {
  ObjectModel ball = primitive_model("ball", Sphere{0.04});
  ball.contact.friction = belief::FixedScalar{0.3};
  Scene scene = floor_scene(ball);
  auto instance = instance_of(scene);
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0.0, 0.0, 0.04};
  start.objects[0].V_WO.linear = {1.0, 0.0, 0.0};
  instance->set_state(start);
  step_for(*instance, 0.5);
  const belief::ObjectState end = instance->state().objects[0];
  EXPECT_NEAR(end.V_WO.linear.x(), 5.0 / 7.0, 1e-3);
  EXPECT_NEAR(end.V_WO.angular.y(), 5.0 / 7.0 / 0.04, 1e-3 / 0.04);
}

TEST(Mechanics, TiltedBoxTipsAtTheAngleOfItsDiagonal) {
  struct Case {
    double width, height;
  };
  for (const Case c : {Case{0.06, 0.2}, Case{0.1, 0.1}, Case{0.12, 0.06}}) {
    const Scene scene = floor_scene(primitive_model("box", BoxShape{{c.width, 0.08, c.height}}));
    expect_tipping_at_the_diagonal(*instance_of(scene), scene, c.width, c.height, 0.02, 0.1);
  }
}

TEST(Mechanics, WeightedBallRocksAsAPendulumAndKeepsItsEnergy) {
  // A ball of radius R with its centre of mass d below its middle, rolling without slip: small rocking has the
  // frequency sqrt(m g d / (I + m (R - d)^2)), and nothing takes energy away.
  const double R = 0.1;
  const double d = 0.03;
  ObjectModel ball = primitive_model("ball", Sphere{R});
  ball.center_of_mass = belief::Vector3Distribution::fixed({0.0, 0.0, -d});
  ball.unit_inertia = geometry::Matrix3d::Identity() * 0.003;
  ball.contact.friction = belief::FixedScalar{1.0};
  Scene scene = floor_scene(ball);
  BulletOptions options;
  options.step = 1.0 / 1000.0;
  auto instance = instance_of(scene, options);
  const double amplitude = 0.1;
  WorldState start = start_of(scene);
  start.objects[0].X_WO = Pose{about(Vector3d::UnitY(), amplitude), {0.0, 0.0, R}};
  instance->set_state(start);
  const double omega = std::sqrt(kG * d / (0.003 + (R - d) * (R - d)));
  const auto energy = [&](const belief::ObjectState& o) {
    const Vector3d com = o.X_WO * Vector3d(0.0, 0.0, -d);
    const Vector3d v = o.V_WO.linear + o.V_WO.angular.cross(com - o.X_WO.translation);
    return 0.5 * v.squaredNorm() + 0.5 * 0.003 * o.V_WO.angular.squaredNorm() + kG * (com.z() - (R - d));
  };
  const double e0 = energy(start.objects[0]);
  double last_crossing = 0.0;
  int crossings = 0;
  double previous = amplitude;
  double largest_late = 0.0;
  for (int n = 1; n <= 10000; ++n) {
    instance->step();
    const belief::ObjectState o = instance->state().objects[0];
    const Vector3d up = o.X_WO.rotation * Vector3d::UnitZ();
    const double angle = std::atan2(up.x(), up.z());
    if (previous > 0.0 && angle <= 0.0) {
      last_crossing = n * options.step;
      ++crossings;
    }
    previous = angle;
    if (n > 9000) largest_late = std::max(largest_late, std::abs(angle));
    ASSERT_NEAR(energy(o), e0, 0.05 * e0) << "at " << n * options.step << " s";
  }
  const double period = (last_crossing - 0.25 * 2.0 * kPi / omega) / (crossings - 1);
  // A pendulum of this amplitude is slower than a small one by 1 + a^2 / 16, here the ball's own rolling adds its
  // share.
  EXPECT_NEAR(period, 2.0 * kPi / omega, 0.01 * 2.0 * kPi / omega);
  EXPECT_NEAR(largest_late, amplitude, 0.03 * amplitude);
}

TEST(Mechanics, ShapesRestAtTheirTrueHeight) {
  struct Case {
    const char* name;
    belief::CollisionShape shape;
    double height;
  };
  auto hull = [](const geometry::TriangleMesh& mesh) {
    return belief::MeshShape{std::make_shared<const geometry::TriangleMesh>(mesh), Pose{},
                             belief::MeshUse::kConvexHull};
  };
  const std::vector<Case> cases = {
      {"sphere", belief::PrimitiveShape{Sphere{0.05}, Pose{}}, 0.05},
      {"box", belief::PrimitiveShape{BoxShape{{0.1, 0.06, 0.04}}, Pose{}}, 0.02},
      {"thin plate", belief::PrimitiveShape{BoxShape{{0.1, 0.1, 0.001}}, Pose{}}, 0.0005},
      {"cylinder", belief::PrimitiveShape{Cylinder{0.03, 0.1}, Pose{}}, 0.05},
      {"cone", belief::PrimitiveShape{Cone{0.04, 0.1}, Pose{}}, 0.05},
      {"lying capsule",
       belief::PrimitiveShape{Capsule{0.02, 0.1}, Pose{about(Vector3d::UnitX(), 0.5 * kPi), Vector3d::Zero()}}, 0.02},
      {"lying cylinder",
       belief::PrimitiveShape{Cylinder{0.03, 0.1}, Pose{about(Vector3d::UnitX(), 0.5 * kPi), Vector3d::Zero()}}, 0.03},
      {"hull of a box", hull(geometry::make_mesh(BoxShape{{0.1, 0.06, 0.04}})), 0.02},
      {"hull of a carton", hull(geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2)), 0.1},
  };
  for (const Case& c : cases) {
    Scene scene = floor_scene(model_of("thing", {c.shape}));
    auto instance = instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.3, 0.1, c.height + 0.01};
    instance->set_state(start);
    step_for(*instance, 2.0);
    const belief::ObjectState end = instance->state().objects[0];
    EXPECT_NEAR(end.X_WO.translation.z(), c.height, 1e-4) << c.name;
    EXPECT_NEAR((end.X_WO.rotation * Vector3d::UnitZ()).z(), 1.0, 1e-6) << c.name;
    EXPECT_LT(end.V_WO.linear.norm(), 1e-4) << c.name;
  }
}

TEST(Mechanics, StackOfFiveBoxesStaysForTenSeconds) {
  Scene scene;
  scene.name = "stack";
  scene.supports.push_back(floor_support());
  for (int i = 0; i < 5; ++i) {
    add_object(scene, primitive_model("box" + std::to_string(i), BoxShape{{0.1, 0.1, 0.1}}), "box" + std::to_string(i));
  }
  expect_stack_stays(*instance_of(scene), scene, 1e-3, 2e-3);
}

}  // namespace
}  // namespace prescene::tests
