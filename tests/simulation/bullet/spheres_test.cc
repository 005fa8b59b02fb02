// SPDX-License-Identifier: Apache-2.0
// Meshes that collide as inner sphere trees, against the closed forms that hold for exact shapes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "bullet_scenes.h"
#include "sphere_scenes.h"
#include "tests/support/closed_forms.h"

namespace prescene::tests::spheres_test {
namespace {

using geometry::BoxShape;
using geometry::Cylinder;
using geometry::Sphere;

TEST(Spheres, ShapesRestAtTheirTrueHeight) {
  struct Case {
    const char* name;
    geometry::TriangleMesh mesh;
    double height;
  };
  for (const Case& c :
       {Case{"box", geometry::make_mesh(BoxShape{{0.1, 0.06, 0.04}}), 0.02},
        Case{"thin plate", geometry::make_mesh(BoxShape{{0.1, 0.1, 0.001}}), 0.0005},
        Case{"cylinder", geometry::make_mesh(Cylinder{0.03, 0.1}, 64), 0.05},
        Case{"carton", geometry::make_gable_carton(0.07, 0.07, 0.15, 0.2), 0.1},
        Case{"bin", geometry::make_open_bin({0.2, 0.15, 0.1}, 0.004), 0.0}, Case{"cup", cup(0.04, 0.09, 0.003), 0.0}}) {
    Scene scene = floor_scene(packed_model("thing", c.mesh));
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

double slide(double angle, double mu) {
  const ObjectModel block = packed_model("block", geometry::make_mesh(BoxShape{{0.1, 0.1, 0.04}}));
  const Scene scene = incline_scene(block, 0.02, angle, mu);
  return slide_for_a_second(*instance_of(scene), scene).moved;
}

TEST(Spheres, BlockSlidesOnAnInclineIffTanThetaExceedsMu) {
  for (const double degrees : {10.0, 20.0, 30.0}) {
    const double angle = degrees * kPi / 180.0;
    const double threshold = std::tan(angle);
    EXPECT_LT(slide(angle, threshold + 5e-4), 1e-5) << degrees;
    EXPECT_GT(slide(angle, threshold - 5e-4), 1e-3) << degrees;
  }
}

TEST(Spheres, TiltedBoxTipsWithinHalfADegreeOfItsDiagonal) {
  struct Case {
    double width, height;
  };
  for (const Case c : {Case{0.06, 0.2}, Case{0.1, 0.1}, Case{0.12, 0.06}}) {
    const Scene scene =
        floor_scene(packed_model("box", geometry::make_mesh(BoxShape{{c.width, 0.08, c.height}}), 1.0, {3000, 1e-3}));
    expect_tipping_at_the_diagonal(*instance_of(scene), scene, c.width, c.height, 0.05, 0.5);
  }
}

/// Three boxes of spheres; `mixed`, the middle one is a box.
Scene stack_of_three(bool mixed) {
  Scene scene;
  scene.name = "stack";
  scene.supports.push_back(floor_support());
  for (int i = 0; i < 3; ++i) {
    const std::string name = "box" + std::to_string(i);
    add_object(scene,
               mixed && i == 1 ? primitive_model(name, BoxShape{{0.1, 0.1, 0.1}})
                               : packed_model(name, geometry::make_mesh(BoxShape{{0.1, 0.1, 0.1}})),
               name);
  }
  return scene;
}

TEST(Spheres, StacksOfThreeStayForTenSeconds) {
  for (const bool mixed : {false, true}) {
    const Scene scene = stack_of_three(mixed);
    expect_stack_stays(*instance_of(scene), scene, 2e-5, 1e-4);
  }
}

TEST(Spheres, StacksStayHoweverTheyStand) {
  // Which of the spheres at a corner bears is noise, and a step takes over which impulses bore it. The offsets are
  // points of a lattice: +-6 mm and +-0.4 rad from box to box.
  for (const bool mixed : {false, true}) {
    const Scene scene = stack_of_three(mixed);
    for (int i = 1; i <= 12; ++i) {
      SCOPED_TRACE("offset " + std::to_string(i) + (mixed ? ", a box between" : ""));
      const auto point = [&](double step) { return std::fmod(step * i, 1.0) - 0.5; };
      const StackOffset offset{0.012 * point(0.8191725), 0.012 * point(0.6710436), 0.8 * point(0.5497005)};
      expect_stack_stays(*instance_of(scene), scene, 5e-6, 5e-5, 1.0, offset);
    }
  }
}

TEST(Spheres, RoundThingsRollDownAnInclineAsTheyShould) {
  struct Case {
    const char* name;
    geometry::TriangleMesh mesh;
    Quaterniond lying;
    double radius, share;  // of g sin(angle)
    double tolerance;
  };
  const double angle = 15.0 * kPi / 180.0;
  for (const Case& c :
       {Case{"cylinder", geometry::make_mesh(Cylinder{0.04, 0.12}, 128), about(Vector3d::UnitX(), 0.5 * kPi), 0.04,
             2.0 / 3.0, 0.05},
        Case{"ball", geometry::make_mesh(Sphere{0.04}, 64), Quaterniond::Identity(), 0.04, 5.0 / 7.0, 0.01}}) {
    Scene scene;
    scene.name = "incline";
    const Quaterniond tilt = about(Vector3d::UnitY(), angle);
    scene.supports.push_back(support_of("plank", {belief::PrimitiveShape{BoxShape{{10.0, 2.0, 0.1}}, Pose{}}},
                                        Pose{tilt, tilt * Vector3d(0.0, 0.0, -0.05)}));
    ObjectModel model = packed_model(c.name, c.mesh);
    model.contact.friction = belief::FixedScalar{0.8};
    add_object(scene, model, c.name);
    auto instance = instance_of(scene);
    WorldState start = start_of(scene);
    start.objects[0].X_WO = Pose{tilt * c.lying, tilt * Vector3d(0.0, 0.0, c.radius)};
    instance->set_state(start);
    step_for(*instance, 1.0);
    const belief::ObjectState end = instance->state().objects[0];
    const double speed = c.share * kG * std::sin(angle);
    EXPECT_NEAR(end.V_WO.linear.norm(), speed, c.tolerance * speed) << c.name;
    EXPECT_NEAR(end.V_WO.angular.norm(), speed / c.radius, c.tolerance * speed / c.radius) << c.name;
  }
}

}  // namespace
}  // namespace prescene::tests::spheres_test
