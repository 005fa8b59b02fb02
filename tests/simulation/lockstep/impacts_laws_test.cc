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
    const double z = stream.normal(), y = stream.normal(), x = stream.normal();
    start.objects[0].V_WO.angular = spin * Vector3d(x, y, z);
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

/// A planar impact by the laws that docs/reference/simulation.md states: the contact leaves with `restitution` times
/// its speed (Newton), and friction holds it, or is `friction` times the normal impulse against the slip (Coulomb).
struct PlanarImpact {
  double tilt = 0.0;               ///< rad about y: which corner of the section is below, and how far to its side.
  Vector3d velocity = {0, 0, -1};  ///< m/s along x and z, rad/s about y: (x, y's turn, z).
  double friction = 0.0;
  double restitution = 0.0;
};

/// Velocities (as in PlanarImpact) after a body of mass 1 kg and moment of inertia `inertia` hits at `arm` from its
/// centre (x, z).
Vector3d after(const PlanarImpact& impact, const Eigen::Vector2d& arm, double inertia) {
  // Rows of the Jacobian for (v_x, w_y, v_z): the corner moves by v + w x r.
  const Vector3d tangent(1.0, arm.y(), 0.0);
  const Vector3d normal(0.0, -arm.x(), 1.0);
  const Vector3d weights(1.0, 1.0 / inertia, 1.0);
  const auto couple = [&](const Vector3d& a, const Vector3d& b) { return a.cwiseProduct(weights).dot(b); };
  const double wanted = -(1.0 + impact.restitution) * normal.dot(impact.velocity);
  Eigen::Matrix2d A;
  A << couple(normal, normal), couple(normal, tangent), couple(tangent, normal), couple(tangent, tangent);
  Eigen::Vector2d p = A.inverse() * Eigen::Vector2d(wanted, -tangent.dot(impact.velocity));
  if (std::abs(p.y()) > impact.friction * p.x()) {
    const double side = p.y() > 0.0 ? impact.friction : -impact.friction;
    p.x() = wanted / (A(0, 0) + side * A(0, 1));
    p.y() = side * p.x();
  }
  return impact.velocity + weights.cwiseProduct(p.x() * normal + p.y() * tangent);
}

TEST_P(Impacts, OfOneEdgeFollowNewtonsAndCoulombsLaws) {
  // Corners are rounded a little, which moves where they hit: that is most of the tolerance.
  for (const double tilt : {0.2, 0.5, 0.9, 1.3}) {
    for (const double sideways : {-1.5, -0.2, 0.0, 0.6}) {
      for (const double turn : {-8.0, 0.0, 5.0}) {
        for (const double friction : {0.05, 0.3, 0.8}) {
          const PlanarImpact impact{tilt, {sideways, turn, -1.5}, friction, 0.5};
          ObjectModel model = primitive_model("bar", BoxShape{{0.08, 0.3, 0.04}}, 1.0);
          model.contact.friction = belief::FixedScalar{friction};
          model.contact.impact_friction = belief::FixedScalar{friction};
          model.contact.restitution = belief::FixedScalar{impact.restitution};
          Scene scene = floor_scene(model);
          scene.gravity_W.setZero();
          // The lowest corner of the section, from the centre.
          Eigen::Vector2d arm(0.0, 0.0);
          for (const double x : {-0.04, 0.04}) {
            for (const double z : {-0.02, 0.02}) {
              const Eigen::Vector2d corner(std::cos(tilt) * x + std::sin(tilt) * z,
                                           -std::sin(tilt) * x + std::cos(tilt) * z);
              if (corner.y() < arm.y()) arm = corner;
            }
          }
          WorldState start = start_of(scene);
          start.objects[0].X_WO = {about(Vector3d::UnitY(), tilt), {0.0, 0.0, 1e-4 - arm.y()}};
          start.objects[0].V_WO.linear = {impact.velocity.x(), 0.0, impact.velocity.z()};
          start.objects[0].V_WO.angular = {0.0, impact.velocity.y(), 0.0};
          const double closing = impact.velocity.z() - arm.x() * impact.velocity.y();
          ASSERT_LT(closing, -0.3);  // m/s
          const belief::ObjectState end = runs_at(scene, {start}, 1e-4, 3e-4)[0].final().objects[0];
          const Vector3d expected = after(impact, arm, scene.models[0].unit_inertia(1, 1));
          const Vector3d reached(end.V_WO.linear.x(), end.V_WO.angular.y(), end.V_WO.linear.z());
          EXPECT_LT((reached - expected).cwiseProduct(Vector3d(1.0, 0.04, 1.0)).norm(), 0.025)
              << "tilt " << tilt << " sideways " << sideways << " turn " << turn << " friction " << friction << ": "
              << reached.transpose() << " for " << expected.transpose();
        }
      }
    }
  }
}

/// Adds a box that a hand moves, and takes the floor away.
void add_plate(Scene& scene, const Vector3d& size, const Pose& X_begin, const Pose& X_end, double duration) {
  belief::KinematicBody plate;
  plate.name = "plate";
  plate.collision = {belief::PrimitiveShape{BoxShape{size}, Pose{}}};
  plate.contact.friction = belief::FixedScalar{1.0};
  plate.contact.restitution = belief::FixedScalar{1.0};
  plate.timeline = {{0.0, X_begin}, {duration, X_end}};
  scene.robot.push_back(plate);
  scene.supports[0].X_WS = Pose::from_translation({0.0, 0.0, -10.0});
}

TEST_P(Impacts, OfAHandThatMovesAreThoseOfOneAtRest) {
  // Galileo: a plate that rises does to what turns above it what one at rest does to the same that falls faster.
  const auto met = [&](double rising) {
    Scene scene = die_of(0.5);
    add_plate(scene, {2.0, 2.0, 0.1}, Pose::from_translation({0.0, 0.0, -0.05}),
              Pose::from_translation({0.0, 0.0, rising - 0.05}), 1.0);
    std::vector<WorldState> starts = thrown(scene, 100, 0.12, 15.0);
    for (WorldState& start : starts) start.objects[0].V_WO.linear.z() = rising - 1.0;
    std::vector<belief::ObjectState> ends;
    for (const belief::Trajectory& run : runs_at(scene, starts, 1.0 / 240.0, 0.15)) {
      ends.push_back(run.final().objects[0]);
      ends.back().V_WO.linear.z() -= rising;
    }
    return ends;
  };
  const auto at_rest = met(0.0), moving = met(1.0);
  std::vector<double> errors;
  for (std::size_t i = 0; i < at_rest.size(); ++i) {
    const geometry::Twist &a = at_rest[i].V_WO, &b = moving[i].V_WO;
    errors.push_back((a.linear - b.linear).norm() + 0.05 * (a.angular - b.angular).norm());  // m/s
  }
  std::sort(errors.begin(), errors.end());
  RecordProperty("median", std::to_string(errors[50]));
  RecordProperty("upper_quartile", std::to_string(errors[75]));
  EXPECT_LT(errors[50], 1e-3);
  EXPECT_LT(errors[75], 5e-3);
}

TEST_P(Impacts, OfASwungHandAreThoseOfItsPlaceAndSpeedAtTheImpact) {
  // A ball without friction leaves with 1 + e times the speed of the paddle where it is hit, square to the paddle.
  constexpr double kRadius = 0.05, kThickness = 0.02, kDistance = 0.5, kSpin = 2.0, kRestitution = 0.5;
  ObjectModel ball = primitive_model("ball", geometry::Sphere{kRadius});
  ball.contact.friction = belief::FixedScalar{0.0};
  ball.contact.impact_friction = belief::FixedScalar{0.0};
  ball.contact.restitution = belief::FixedScalar{kRestitution};
  Scene scene = floor_scene(ball);
  scene.gravity_W.setZero();
  add_plate(scene, {1.4, kThickness, 0.3}, Pose{about(Vector3d::UnitZ(), -0.5), {}},
            Pose{about(Vector3d::UnitZ(), kSpin - 0.5), {}}, 1.0);
  WorldState start = start_of(scene);
  start.objects[0].X_WO.translation = {kDistance, 0.0, 0.0};
  const double apart = kRadius + 0.5 * kThickness;
  const double angle = -std::asin(apart / kDistance);
  const double speed = (1.0 + kRestitution) * kSpin * std::sqrt(kDistance * kDistance - apart * apart);
  const Vector3d expected = speed * Vector3d(-std::sin(angle), std::cos(angle), 0.0);
  for (const double step : {1.0 / 60.0, 1.0 / 240.0, 1.0 / 1000.0}) {
    const Vector3d reached = runs_at(scene, {start}, step, 0.3)[0].final().objects[0].V_WO.linear;
    EXPECT_LT((reached - expected).norm(), 5e-3) << step << ": " << reached.transpose();
  }
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
