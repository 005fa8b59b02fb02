// SPDX-License-Identifier: Apache-2.0
// Rods turn about their own axis by radians in a step, with next to no inertia about it: contacts must not make energy
// of that. Of both steppers.
#include <gtest/gtest.h>

#include "lockstep_scenes.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;
using geometry::Cylinder;

struct Stepper {
  const char* name;
  std::unique_ptr<simulation::Simulator> (*make)(const Scene& scene);
};
void PrintTo(const Stepper& stepper, std::ostream* out) { *out << stepper.name; }

class SlenderBodies : public testing::TestWithParam<Stepper> {};

double energy(const Scene& scene, const WorldState& state) {
  const belief::ObjectState& object = state.objects[0];
  const Vector3d w_O = object.X_WO.rotation.conjugate() * object.V_WO.angular;
  return kG * object.X_WO.translation.z() + 0.5 * object.V_WO.linear.squaredNorm() +
         0.5 * w_O.dot(scene.models[0].unit_inertia * w_O);
}

TEST_P(SlenderBodies, StrikeFloorsAndEdgesWithoutGainingEnergy) {
  const geometry::Primitive shapes[] = {Cylinder{0.0005, 0.3}, Cylinder{0.0015, 0.3}, Cylinder{0.001, 0.065},
                                        Cylinder{0.004, 0.14}, BoxShape{{0.007, 0.007, 0.23}}};
#ifdef NDEBUG
  constexpr int kThrows = 200;
#else
  constexpr int kThrows = 20;
#endif
  for (const geometry::Primitive& shape : shapes) {
    for (const double restitution : {0.0, 0.5}) {
      ObjectModel rod = primitive_model("rod", shape);
      rod.contact.restitution = belief::FixedScalar{restitution};
      Scene scene = floor_scene(rod);
      scene.supports.push_back(support_of("block", {belief::PrimitiveShape{BoxShape{{0.1, 0.3, 0.08}}, Pose{}}},
                                          Pose::from_translation({0.05, 0.0, 0.04})));
      core::RandomStream random(1, core::Purpose::kTest);
      const auto any = [&](double size) {
        const double z = random.uniform(-size, size), y = random.uniform(-size, size), x = random.uniform(-size, size);
        return Vector3d(x, y, z);
      };
      std::vector<WorldState> starts(kThrows, start_of(scene));
      for (WorldState& start : starts) {
        start.objects[0].X_WO = {geometry::exp_rotation(any(2.0)), Vector3d(0.0, 0.0, 0.6) + any(0.1)};
        start.objects[0].V_WO = {any(12.0), any(1.0)};
      }
      simulation::RunRequest request;
      request.stop.duration = 2.0;
      request.sample_interval = 1.0 / 240.0;
      for (const belief::Trajectory& run : run_all(*GetParam().make(scene), starts, request, 2)) {
        ASSERT_NE(run.end, belief::TrajectoryEnd::kDiverged);
        const double begin = energy(scene, run.states.front());
        for (const WorldState& state : run.states) {
          ASSERT_LT(energy(scene, state), 1.005 * begin) << "at " << state.time << " s";
          ASSERT_GT(state.objects[0].X_WO.translation.z(), -1e-3) << "at " << state.time << " s";
        }
      }
    }
  }
}

TEST_P(SlenderBodies, RollOn) {
  constexpr double kSpeed = 1.0;
  for (const double radius : {0.002, 0.004, 0.01, 0.035}) {
    const Scene scene = floor_scene(primitive_model("rod", Cylinder{radius, 0.14}));
    WorldState start = start_of(scene);
    start.objects[0].X_WO = {about(Vector3d::UnitX(), 0.5 * kPi), {0.0, 0.0, radius}};
    start.objects[0].V_WO.linear = {kSpeed, 0.0, 0.0};
    start.objects[0].V_WO.angular = {0.0, kSpeed / radius, 0.0};
    simulation::RunRequest request;
    request.stop.duration = 1.0;
    const belief::Trajectory run = run_all(*GetParam().make(scene), {start}, request)[0];
    const belief::ObjectState& end = run.final().objects[0];
    EXPECT_NEAR(end.X_WO.translation.x(), kSpeed, 0.01) << radius;
    EXPECT_NEAR(end.X_WO.translation.y(), 0.0, 0.01) << radius;
    EXPECT_NEAR(end.V_WO.linear.x(), kSpeed, 0.01) << radius;
    EXPECT_NEAR(end.V_WO.angular.y(), kSpeed / radius, 0.01 * kSpeed / radius) << radius;
  }
}

/// A ball turns about an axis that contacts don't change.
TEST_P(SlenderBodies, RoundOnesKeepTheirSpinAboutTheVerticalAsTheyRoll) {
  Scene scene = floor_scene(primitive_model("ball", geometry::Sphere{0.03}));
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0.0, 0.0, 0.03};
  start.objects[0].V_WO.linear = {2.0, 0.0, 0.0};  // slides first
  start.objects[0].V_WO.angular = {0.0, 0.0, 20.0};
  simulation::RunRequest request;
  request.stop.duration = 1.0;
  const belief::ObjectState end = run_all(*GetParam().make(scene), {start}, request)[0].final().objects[0];
  EXPECT_NEAR(end.V_WO.linear.x(), 2.0 * 5.0 / 7.0, 0.01);
  EXPECT_NEAR(end.V_WO.angular.z(), 20.0, 0.05);
  EXPECT_NEAR(end.V_WO.angular.x(), 0.0, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Steppers, SlenderBodies,
                         testing::Values(Stepper{"bullet", &bullet_of},
                                         Stepper{"lockstep", [](const Scene& scene) { return lockstep_of(scene); }}),
                         testing::PrintToStringParamName());

}  // namespace
}  // namespace prescene::tests
