// SPDX-License-Identifier: Apache-2.0
// Small scenes with known mechanics, and short ways to run them with any stepper.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/simulation/simulator.h"

namespace prescene::tests {

using belief::ObjectModel;
using belief::Scene;
using belief::WorldState;
using geometry::Pose;
using geometry::Quaterniond;
using geometry::Vector3d;

inline constexpr double kG = 9.81;
inline constexpr double kPi = std::numbers::pi;

inline Quaterniond about(const Vector3d& axis, double angle) {
  return Quaterniond(Eigen::AngleAxisd(angle, axis.normalized()));
}

inline ObjectModel model_of(const std::string& name, std::vector<belief::CollisionShape> shapes, double mass = 1.0) {
  ObjectModel model;
  model.name = name;
  model.collision = std::move(shapes);
  model.mass = belief::FixedScalar{mass};
  model.contact.friction = belief::FixedScalar{0.5};
  model.contact.restitution = belief::FixedScalar{0.0};
  auto derived = belief::with_derived_properties(model);
  return derived ? *derived : model;
}

inline ObjectModel primitive_model(const std::string& name, const geometry::Primitive& primitive, double mass = 1.0) {
  return model_of(name, {belief::PrimitiveShape{primitive, Pose{}}}, mass);
}

/// A support that brings friction 1 and restitution 1, so that the objects' own values are the pair's.
inline belief::Support support_of(const std::string& name, std::vector<belief::CollisionShape> shapes,
                                  const Pose& X_WS) {
  belief::Support support;
  support.name = name;
  support.collision = std::move(shapes);
  support.X_WS = X_WS;
  support.contact.friction = belief::FixedScalar{1.0};
  support.contact.restitution = belief::FixedScalar{1.0};
  return support;
}

/// A big box whose upper face is z = 0.
inline belief::Support floor_support() {
  return support_of("floor", {belief::PrimitiveShape{geometry::BoxShape{{20.0, 20.0, 1.0}}, Pose{}}},
                    Pose::from_translation({0.0, 0.0, -0.5}));
}

inline int add_object(Scene& scene, const ObjectModel& model, const std::string& name) {
  scene.models.push_back(model);
  belief::SceneObject object;
  object.name = name;
  object.model = static_cast<int>(scene.models.size()) - 1;
  scene.objects.push_back(object);
  return static_cast<int>(scene.objects.size()) - 1;
}

/// A scene of one object on the floor.
inline Scene floor_scene(const ObjectModel& model) {
  Scene scene;
  scene.name = "test";
  scene.supports.push_back(floor_support());
  add_object(scene, model, "object");
  return scene;
}

inline WorldState start_of(const Scene& scene) { return belief::mean_start(scene); }

inline belief::Trajectory run_one(const simulation::Simulator& simulator, const WorldState& start,
                                  const simulation::RunRequest& request) {
  core::ThreadPool pool(1);
  std::vector<belief::Trajectory> runs(1);
  simulator.run({&start, 1}, request, core::RandomStream(1, core::Purpose::kTest), 0, pool, runs);
  return runs[0];
}

inline void step_for(simulation::Instance& instance, double seconds) {
  const long steps = std::lround(seconds / instance.step_size());
  for (long i = 0; i < steps; ++i) instance.step();
}

}  // namespace prescene::tests
