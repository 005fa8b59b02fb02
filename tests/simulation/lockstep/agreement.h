// SPDX-License-Identifier: Apache-2.0
// The lockstep stepper beside Bullet's: the same starts in both, and the same steps.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "lockstep_scenes.h"
#include "prescene/geometry/sampling.h"

namespace prescene::tests {

/// How many starts fall in each class with both steppers, and in which they agree start by start.
struct Shares {
  std::vector<int> bullet, lockstep;
  int same = 0;
};
inline Shares shares_of(const Scene& scene, int count) {
  const std::vector<WorldState> starts = drawn_starts(scene, count, 11);
  simulation::RunRequest request;
  request.stop.duration = scene.duration;
  request.stop.stop_at_rest = scene.stop_at_rest;
  request.actions = scene.actions;
  const auto bullet = run_all(*bullet_of(scene), starts, request);
  const auto lockstep = run_all(*lockstep_of(scene), starts, request);
  const belief::ExclusiveOutcomes& classes = scene.exclusive_outcomes.front();
  Shares shares;
  shares.bullet.assign(classes.outcomes.size() + 1, 0);
  shares.lockstep = shares.bullet;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const int a = belief::classify(scene, bullet[i], classes);
    const int b = belief::classify(scene, lockstep[i], classes);
    ++shares.bullet[static_cast<std::size_t>(a)];
    ++shares.lockstep[static_cast<std::size_t>(b)];
    shares.same += a == b ? 1 : 0;
  }
  return shares;
}

/// The same starts are given to both, so that a difference of n instances in a class has a variance of at most the
/// number of starts that disagree. False alarms: one in 1,000 a scene.
inline void expect_same_distribution(const Scene& scene, int count, double least_same) {
  const Shares shares = shares_of(scene, count);
  const int changed = count - shares.same;
  EXPECT_GE(shares.same, least_same * count) << scene.name;
  const double z = 3.8;  // six classes at most
  testing::Test::RecordProperty(scene.name + "_same", std::to_string(shares.same));
  for (std::size_t k = 0; k < shares.bullet.size(); ++k) {
    testing::Test::RecordProperty(scene.name + "_" + std::to_string(k),
                                  std::to_string(shares.bullet[k]) + " / " + std::to_string(shares.lockstep[k]));
    EXPECT_LE(std::abs(shares.bullet[k] - shares.lockstep[k]), 1.0 + z * std::sqrt(static_cast<double>(changed)))
        << scene.name << " class " << k << ": " << shares.bullet[k] << " and " << shares.lockstep[k] << " of " << count;
  }
}

/// What a thing meets in one step.
enum class Opposite { kFixed, kKinematic, kFree };

struct StepErrors {
  std::size_t touching = 0;
  std::size_t different = 0;
  std::vector<double> errors;  // ascending
};

/// Random poses and speeds of a thing about another: how much the changes of velocities in a step differ.
inline StepErrors compare_steps(const belief::CollisionShape& shape, const belief::CollisionShape& other,
                                Opposite opposite, int poses = 16000) {
  Scene scene;
  scene.name = "edge";
  const Pose X_WB{about({1.0, 0.3, 0.2}, 0.4), Vector3d(0.02, 0.01, 0.03)};
  ObjectModel model = model_of("thing", {shape});
  model.contact.restitution = belief::FixedScalar{0.4};
  add_object(scene, model, "thing");
  if (opposite == Opposite::kFixed) scene.supports.push_back(support_of("fixed", {other}, X_WB));
  if (opposite == Opposite::kKinematic) {
    belief::KinematicBody hand;
    hand.name = "hand";
    hand.collision = {other};
    hand.contact.restitution = belief::FixedScalar{1.0};
    const Pose X_end{about({0.2, 1.0, 0.1}, 0.5) * X_WB.rotation, X_WB.translation + Vector3d(0.4, -0.3, 0.5)};
    hand.timeline = {{0.0, X_WB}, {1.0, X_end}};
    scene.robot.push_back(hand);
  }
  if (opposite == Opposite::kFree) {
    ObjectModel second = model_of("second", {other}, 0.6);
    second.contact.restitution = belief::FixedScalar{0.9};
    add_object(scene, second, "second");
  }
  auto bullet = bullet_of(scene)->make_instance({}, core::RandomStream(1, core::Purpose::kTest));
  auto lockstep = lockstep_instance_of(scene);
  core::RandomStream stream(17, core::Purpose::kTest);
  StepErrors result;
  const auto velocity_of_mass = [](const belief::ObjectState& o) {
    return Vector3d(o.V_WO.linear + o.V_WO.angular.cross(o.X_WO.rotation * o.physical.center_of_mass));
  };
  for (int i = 0; i < poses; ++i) {
    WorldState start = start_of(scene);
    belief::ObjectState& object = start.objects[0];
    object.X_WO = Pose{geometry::uniform_rotation(stream),
                       {stream.uniform(-0.35, 0.35), stream.uniform(-0.3, 0.3), stream.uniform(-0.2, 0.25)}};
    if (opposite == Opposite::kFree) start.objects[1].X_WO = X_WB;
    // Overlap is parted another way, and shows at rest.
    bullet->set_state(start);
    bullet->step();
    const Vector3d fallen = bullet->state().objects[0].X_WO.translation - object.X_WO.translation;
    if ((fallen - 0.5 * scene.gravity_W / (240.0 * 240.0)).norm() > 1e-7) continue;
    object.V_WO.linear = -5.0 * object.X_WO.translation + 0.5 * geometry::normal_vector(stream);
    object.V_WO.angular = 5.0 * geometry::normal_vector(stream);
    if (opposite == Opposite::kFree) {
      start.objects[1].V_WO.linear = 0.5 * geometry::normal_vector(stream);
      start.objects[1].V_WO.angular = 5.0 * geometry::normal_vector(stream);
    }
    bullet->set_state(start);
    lockstep->set_state(start);
    bullet->step();
    lockstep->step();
    double change = 0.0, error = 0.0;
    for (std::size_t k = 0; k < start.objects.size(); ++k) {
      const belief::ObjectState a = bullet->state().objects[k];
      const belief::ObjectState b = lockstep->state().objects[k];
      const Vector3d free = velocity_of_mass(start.objects[k]) + scene.gravity_W / 240.0;
      change = std::max({change, (velocity_of_mass(a) - free).norm(), (velocity_of_mass(b) - free).norm()});
      error = std::max(error, (a.V_WO.linear - b.V_WO.linear).norm() + 0.05 * (a.V_WO.angular - b.V_WO.angular).norm());
    }
    if (change < 1e-3) continue;
    ++result.touching;
    result.errors.push_back(error);
    if (error > 0.01) ++result.different;
  }
  std::sort(result.errors.begin(), result.errors.end());
  return result;
}

}  // namespace prescene::tests
