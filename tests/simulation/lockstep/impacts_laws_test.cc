// SPDX-License-Identifier: Apache-2.0
// Impacts of what turns and falls fast do not depend on where in a step they are. Of both steppers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lockstep_scenes.h"
#include "prescene/geometry/sampling.h"

namespace prescene::tests {
namespace {

using geometry::BoxShape;

/// A steel cuboid with two square faces, `ratio` as high as it is wide.
Scene die_of(double ratio) {
  belief::ObjectModel model = primitive_model("die", BoxShape{{0.1, 0.1, 0.1 * ratio}}, 7.8 * ratio);
  model.contact.friction = belief::FixedScalar{0.3};
  model.contact.restitution = belief::FixedScalar{0.5};
  return floor_scene(model);
}

std::vector<WorldState> thrown(const Scene& scene, int count, double height, double spin) {
  std::vector<WorldState> starts;
  core::RandomStream stream(3, core::Purpose::kTest);
  for (int i = 0; i < count; ++i) {
    WorldState start = start_of(scene);
    start.objects[0].X_WO = {geometry::uniform_rotation(stream), {0.0, 0.0, height}};
    start.objects[0].V_WO.angular = spin * Vector3d(stream.normal(), stream.normal(), stream.normal());
    starts.push_back(start);
  }
  return starts;
}

std::unique_ptr<simulation::Simulator> of_lockstep(const Scene& scene, const simulation::MechanicsOptions& options) {
  return lockstep_of(scene, LockstepOptions{options});
}
std::unique_ptr<simulation::Simulator> of_bullet(const Scene& scene, const simulation::MechanicsOptions& options) {
  simulation::ShapeStore shapes(simulation::hacd_decomposer());
  auto simulator = simulation::make_bullet_simulator(scene, shapes, simulation::BulletOptions{options});
  PRESCENE_CHECK(simulator.ok());
  return *std::move(simulator);
}

struct AnyStepper {
  const char* name;
  std::unique_ptr<simulation::Simulator> (*make)(const Scene& scene, const simulation::MechanicsOptions& options);
  int throws;  ///< As many as take seconds.
};
void PrintTo(const AnyStepper& stepper, std::ostream* out) { *out << stepper.name; }

class Impacts : public testing::TestWithParam<AnyStepper> {
 protected:
  static std::vector<belief::Trajectory> runs_at(const Scene& scene, const std::vector<WorldState>& starts, double step,
                                                 double duration) {
    simulation::MechanicsOptions options;
    options.step = step;
    simulation::RunRequest request;
    request.stop.duration = duration;
    return run_all(*GetParam().make(scene, options), starts, request, 2);
  }
};

TEST_P(Impacts, OfATurningBodyAreThoseOfAFinerStep) {
  // From 0.3 m for 0.27 s: through the first impact, and often a second one.
  const Scene scene = die_of(0.5);
  const std::vector<WorldState> starts = thrown(scene, 300, 0.3, 15.0);
  const auto plain = runs_at(scene, starts, 1.0 / 240.0, 0.27);
  const auto fine = runs_at(scene, starts, 1.0 / 7680.0, 0.27);
  std::vector<double> errors;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const belief::ObjectState& a = plain[i].final().objects[0];
    const belief::ObjectState& b = fine[i].final().objects[0];
    errors.push_back(0.05 * (a.V_WO.angular - b.V_WO.angular).norm());  // m/s, at the side
  }
  std::sort(errors.begin(), errors.end());
  RecordProperty("median", std::to_string(errors[150]));
  RecordProperty("upper_quartile", std::to_string(errors[225]));
  EXPECT_LT(errors[150], 0.02);
  EXPECT_LT(errors[225], 0.1);
}

double share_of_square_faces(const std::vector<belief::Trajectory>& runs) {
  double square = 0.0;
  for (const belief::Trajectory& run : runs) {
    Eigen::Index axis = 0;
    run.final().objects[0].X_WO.rotation.toRotationMatrix().row(2).cwiseAbs().maxCoeff(&axis);
    square += axis == 2 ? 1.0 : 0.0;
  }
  return square / static_cast<double>(runs.size());
}

TEST_P(Impacts, HalvingTheStepOfDiceShiftsNoShare) {
  const int count = GetParam().throws;
  for (const double ratio : {0.5, 0.8, 1.4}) {
    const Scene scene = die_of(ratio);
    const std::vector<WorldState> starts = thrown(scene, count, 0.8, 3.0);
    const double plain = share_of_square_faces(runs_at(scene, starts, 1.0 / 240.0, 8.0));
    const double half = share_of_square_faces(runs_at(scene, starts, 1.0 / 480.0, 8.0));
    // Chaotic: as of independent starts. False alarms: one in 1,000 of them.
    EXPECT_NEAR(plain, half, 3.3 * std::sqrt(2.0 * half * (1.0 - half) / count)) << ratio;
  }
}

TEST_P(Impacts, SharesOfAFlatDieAreThoseOfAFinerStep) {
  const int count = 5 * GetParam().throws / 2;
  const Scene scene = die_of(0.5);
  const std::vector<WorldState> starts = thrown(scene, count, 0.8, 3.0);
  const double plain = share_of_square_faces(runs_at(scene, starts, 1.0 / 240.0, 8.0));
  const double fine = share_of_square_faces(runs_at(scene, starts, 1.0 / 960.0, 8.0));
  EXPECT_NEAR(plain, fine, 3.3 * std::sqrt(2.0 * fine * (1.0 - fine) / count));
}

INSTANTIATE_TEST_SUITE_P(
    Steppers, Impacts, testing::Values(AnyStepper{"lockstep", of_lockstep, 1000}, AnyStepper{"bullet", of_bullet, 200}),
    [](const testing::TestParamInfo<AnyStepper>& stepper) { return std::string(stepper.param.name); });

}  // namespace
}  // namespace prescene::tests
