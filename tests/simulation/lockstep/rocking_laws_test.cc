// SPDX-License-Identifier: Apache-2.0
// What rocks, wobbles or rolls loses what the laws of impact take, and no more for being computed in longer steps. Of
// both steppers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lockstep_scenes.h"

namespace prescene::tests {
namespace rocking_laws_test {

using geometry::BoxShape;

std::unique_ptr<simulation::Instance> of_lockstep(const Scene& scene, const simulation::MechanicsOptions& options) {
  return lockstep_of(scene, LockstepOptions{options})
      ->make_instance(scene.actions, core::RandomStream(1, core::Purpose::kTest));
}
std::unique_ptr<simulation::Instance> of_bullet(const Scene& scene, const simulation::MechanicsOptions& options) {
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  auto simulator = simulation::make_bullet_simulator(scene, shapes, simulation::BulletOptions{options});
  PRESCENE_CHECK(simulator.ok());
  return (*simulator)->make_instance(scene.actions, core::RandomStream(1, core::Purpose::kTest));
}

struct AnyStepper {
  const char* name;
  std::unique_ptr<simulation::Instance> (*make)(const Scene& scene, const simulation::MechanicsOptions& options);
};
void PrintTo(const AnyStepper& stepper, std::ostream* out) { *out << stepper.name; }

/// A block `width` wide and `height` high that rocks about its edges on a floor, without bounces or slip. Two rigid
/// bodies that meet in an edge keep their angular momentum about it [Housner 1963, eq. 5]: of the energy above that at
/// rest, a share is left after each impact.
struct Rocker {
  double width, height, let_go;  // m, m, rad

  double radius() const { return 0.5 * std::hypot(width, height); }
  double critical() const { return std::atan2(width, height); }
  double kept_at_impact() const {
    const double r = 1.0 - 1.5 * std::pow(std::sin(critical()), 2);
    return r * r;
  }
  /// J/kg above that at rest, where it turns around.
  double energy_at(double angle) const {
    return kG * radius() * (std::cos(critical() - std::abs(angle)) - std::cos(critical()));
  }
};

class Rocking : public testing::TestWithParam<AnyStepper> {
 protected:
  static Scene scene_of(const Rocker& rocker) {
    ObjectModel model = primitive_model("block", BoxShape{{rocker.width, 0.08, rocker.height}});
    model.contact.friction = belief::FixedScalar{1.0};
    model.contact.restitution = belief::FixedScalar{0.0};
    return floor_scene(model);
  }
  /// On its edge, with edges that are all but sharp.
  static std::unique_ptr<simulation::Instance> let_go(const Rocker& rocker, const Scene& scene, double step) {
    simulation::MechanicsOptions options;
    options.step = step;
    options.edge_rounding = 2e-5;
    auto instance = GetParam().make(scene, options);
    WorldState start = start_of(scene);
    const double height = rocker.radius() * std::cos(rocker.critical() - rocker.let_go);
    start.objects[0].X_WO = {about(Vector3d::UnitY(), rocker.let_go), {0.0, 0.0, height}};
    instance->set_state(start);
    return instance;
  }
  static double angle_of(const simulation::Instance& instance) {
    const Vector3d up = instance.state().objects[0].X_WO.rotation * Vector3d::UnitZ();
    return std::atan2(up.x(), up.z());
  }
  /// Energies at the turning points: after the start, after the first impact, and so on.
  static std::vector<double> energies(const Rocker& rocker, double step, std::size_t count) {
    const Scene scene = scene_of(rocker);
    const auto instance = let_go(rocker, scene, step);
    std::vector<double> found;
    double farthest = 0.0, side = 1.0;
    for (double t = 0.0; t < 4.0 && found.size() < count; t += step) {
      instance->step();
      const double angle = angle_of(*instance);
      if (angle * side < -1e-3) {
        found.push_back(rocker.energy_at(farthest));
        farthest = 0.0;
        side = -side;
      }
      farthest = std::max(farthest, angle * side);
    }
    return found;
  }
};

TEST_P(Rocking, TakesNoMoreEnergyThanTheImpactsDo) {
  constexpr int kImpacts = 5;
  for (const Rocker& rocker : {Rocker{0.06, 0.2, 10 * kPi / 180}, Rocker{0.06, 0.2, 8 * kPi / 180},
                               Rocker{0.04, 0.2, 6 * kPi / 180}, Rocker{0.1, 0.2, 10 * kPi / 180}}) {
    const std::vector<double> found = energies(rocker, 1.0 / 240.0, kImpacts + 1);
    ASSERT_EQ(found.size(), kImpacts + 1u);
    // Without the middle of steps, half of it is left or less.
    const double left = found.back() / rocker.energy_at(rocker.let_go) / std::pow(rocker.kept_at_impact(), kImpacts);
    EXPECT_GT(left, 0.75) << rocker.width;
    EXPECT_LT(left, 1.03) << rocker.width;
  }
}

TEST_P(Rocking, BetweenImpactsIsExactToTheSquareOfTheStep) {
  // The angle shortly before the first impact. Without the middle of steps its error is proportional to the step.
  const Rocker rocker{0.06, 0.2, 10 * kPi / 180};
  const Scene scene = scene_of(rocker);
  const auto angle_at = [&](double time, double step) {
    const auto instance = let_go(rocker, scene, step);
    step_for(*instance, time);
    return angle_of(*instance);
  };
  const double time = 24.0 / 240.0;
  const double fine = angle_at(time, 1.0 / 3840.0);
  ASSERT_GT(fine, 0.03);
  const double coarse_error = std::abs(angle_at(time, 1.0 / 120.0) - fine);
  const double error = std::abs(angle_at(time, 1.0 / 240.0) - fine);
  RecordProperty("error_at_120", std::to_string(coarse_error));
  RecordProperty("error_at_240", std::to_string(error));
  EXPECT_LT(error, 0.35 * coarse_error);
  EXPECT_LT(error, 3e-4);
}

TEST_P(Rocking, ABlowTipsABlockIfItsEnergySuffices) {
  // A blow at the centre of percussion turns the block about its edge: impulse * height = moment * spin, and it tips if
  // that lifts its centre of mass over the edge.
  const Rocker rocker{0.06, 0.2, 0.0};
  const double moment = 4.0 / 3.0 * rocker.radius() * rocker.radius();
  const double height = 2.0 * moment / rocker.height;
  const double spin = std::sqrt(2.0 * kG * rocker.radius() * (1.0 - std::cos(rocker.critical())) / moment);
  const double enough = moment * spin / height;
  const auto tips = [&](double impulse) {
    Scene scene = scene_of(rocker);
    belief::Bump bump;
    bump.object = "object";
    bump.impulse = belief::Vector3Distribution::fixed({impulse, 0.0, 0.0});
    bump.point_O = Vector3d(0.0, 0.0, height - 0.5 * rocker.height);
    scene.actions = {{0.1, bump}};
    simulation::MechanicsOptions options;
    options.edge_rounding = 2e-5;
    auto instance = GetParam().make(scene, options);
    instance->set_state(start_of(scene));
    step_for(*instance, 3.0);
    return std::abs(angle_of(*instance)) > 1.0;
  };
  EXPECT_FALSE(tips(0.992 * enough));
  EXPECT_TRUE(tips(1.008 * enough));
}

TEST_P(Rocking, AWobbleThatRollsKeepsItsEnergy) {
  // A cylinder rolls on its rim: the point that touches stands still, so that no force does work, however fast it runs
  // round the rim.
  constexpr double kRadius = 0.03, kHalf = 0.1;
  ObjectModel model = primitive_model("can", geometry::Cylinder{kRadius, 2.0 * kHalf});
  model.contact.friction = belief::FixedScalar{1.0};
  model.contact.restitution = belief::FixedScalar{0.0};
  const Scene scene = floor_scene(model);
  const Vector3d moments = model.unit_inertia.diagonal();
  const auto energy_of = [&](const belief::ObjectState& object) {
    const Vector3d spin_O = object.X_WO.rotation.conjugate() * object.V_WO.angular;
    return 0.5 * object.V_WO.linear.squaredNorm() + 0.5 * spin_O.dot(moments.cwiseProduct(spin_O)) +
           kG * object.X_WO.translation.z();
  };
  for (const double heading : {0.0, 0.5, 1.3}) {
    simulation::MechanicsOptions options;
    options.edge_rounding = 2e-5;
    auto instance = GetParam().make(scene, options);
    WorldState start = start_of(scene);
    belief::ObjectState& object = start.objects[0];
    object.X_WO.rotation = about(Vector3d::UnitZ(), heading) * about(Vector3d::UnitY(), 4.0 * kPi / 180.0);
    const Vector3d arm = object.X_WO.rotation * Vector3d(kRadius, 0.0, -kHalf);  // the lowest point
    object.X_WO.translation = {0.0, 0.0, -arm.z()};
    object.V_WO.angular = about(Vector3d::UnitZ(), heading) * Vector3d(0.2, 0.15, -0.8);
    object.V_WO.linear = -object.V_WO.angular.cross(arm);
    instance->set_state(start);
    const double begun = energy_of(object), resting = kG * kHalf;
    ASSERT_GT(begun, resting + 0.015);
    step_for(*instance, 1.0);
    // Where the points beside the lowest one take part, a third of it is gone by then.
    EXPECT_NEAR(energy_of(instance->state().objects[0]), begun, 0.1 * (begun - resting)) << heading;
  }
}

TEST_P(Rocking, WhatRubsStopsWhereItShould) {
  // v^2 / (2 mu g). Without the middle of steps it is off by v times half of a step, 2 mm.
  ObjectModel block = primitive_model("block", BoxShape{{0.1, 0.1, 0.04}});
  block.contact.friction = belief::FixedScalar{0.25};
  const Scene scene = floor_scene(block);
  for (const double heading : {0.0, 0.3}) {
    auto instance = GetParam().make(scene, {});
    WorldState start = start_of(scene);
    start.objects[0].X_WO.translation = {0.0, 0.0, 0.02};
    start.objects[0].V_WO.linear = {std::cos(heading), std::sin(heading), 0.0};
    instance->set_state(start);
    step_for(*instance, 1.0);
    const Vector3d end = instance->state().objects[0].X_WO.translation;
    EXPECT_NEAR(end.head<2>().norm(), 1.0 / (2.0 * 0.25 * kG), 2e-4) << heading;
  }
}

TEST_P(Rocking, WhatRollsGoesAsFarAsItShould) {
  // A ball that is thrown without spin slides, at an acceleration of -mu g, until it rolls at 5/7 of its speed.
  ObjectModel ball = primitive_model("ball", geometry::Sphere{0.05});
  ball.contact.friction = belief::FixedScalar{0.2};
  const Scene scene = floor_scene(ball);
  auto instance = GetParam().make(scene, {});
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {0.0, 0.0, 0.05};
  start.objects[0].V_WO.linear = {1.0, 0.0, 0.0};
  instance->set_state(start);
  step_for(*instance, 1.0);
  const double sliding = 2.0 / 7.0 / (0.2 * kG);
  const double way = sliding - 0.5 * 0.2 * kG * sliding * sliding + 5.0 / 7.0 * (1.0 - sliding);
  EXPECT_NEAR(instance->state().objects[0].X_WO.translation.x(), way, 2e-4);
}

INSTANTIATE_TEST_SUITE_P(Steppers, Rocking,
                         testing::Values(AnyStepper{"bullet", &of_bullet}, AnyStepper{"lockstep", &of_lockstep}),
                         [](const auto& tested) { return tested.param.name; });

}  // namespace rocking_laws_test
}  // namespace prescene::tests
