// SPDX-License-Identifier: Apache-2.0
#include "tests/filter/pushed_box.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/geometry/sampling.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"

namespace prescene::filter_tests {
namespace {

using belief::Pose;
using geometry::Vector3d;

constexpr double kFrame = 1.0 / 30.0;
const Vector3d kBox(0.10, 0.08, 0.06);
const Vector3d kPusher(0.02, 0.06, 0.04);

Pose on_slope(const Push& push, const Vector3d& p) {
  const geometry::Quaterniond R = geometry::exp_rotation({0.0, push.slope, 0.0});
  return {R, R * p};
}

/// Waits 3 cm behind the box, comes after a third of the frames, and stops after 12 cm.
std::vector<belief::KinematicBody::Waypoint> pusher_path(const Push& push) {
  const double x = -0.5 * kBox.x() - 0.5 * kPusher.x() - 0.03;
  const Pose X_wait = on_slope(push, {x, push.aside, 0.03}), X_end = on_slope(push, {x + 0.12, push.aside, 0.03});
  const double begin = push.frames / 3 * kFrame;
  if (!(push.speed > 0.0)) return {{0.0, X_wait}};
  return {{0.0, X_wait}, {begin, X_wait}, {begin + 0.12 / push.speed, X_end}};
}

}  // namespace

std::shared_ptr<const belief::Scene> push_scene(const Push& push) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "push";
  belief::ObjectModel box;
  box.name = "box";
  box.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{kBox}, Pose::identity()});
  box.contact.friction = belief::UniformScalar{0.1, 0.9};
  box.mass = belief::NormalScalar{0.4, 0.05, 0.2, 0.6};
  scene->models.push_back(*belief::with_derived_properties(box));
  belief::Support table;
  table.name = "table";
  table.collision.push_back(
      belief::PrimitiveShape{geometry::BoxShape{Vector3d(3.0, 3.0, 0.04)}, Pose::from_translation({0.0, 0.0, -0.02})});
  table.X_WS = on_slope(push, Vector3d::Zero());
  table.contact.friction = belief::FixedScalar{1.0};
  scene->supports.push_back(table);
  belief::KinematicBody pusher;
  pusher.name = "pusher";
  pusher.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{kPusher}, Pose::identity()});
  pusher.timeline = pusher_path(push);
  scene->robot.push_back(pusher);
  belief::SceneObject object;
  object.name = "box";
  object.pose = belief::FixedPose{on_slope(push, {0.0, 0.0, 0.5 * kBox.z()})};
  if (push.held) object.held_by = "pusher";
  scene->objects.push_back(object);
  return scene;
}

simulation::SimulatorFactory push_simulators() {
  static simulation::ShapeStore shapes;
  return [](const belief::Scene& scene, double step_factor) {
    simulation::LockstepOptions options;
    options.step *= step_factor;
    return simulation::make_lockstep_simulator(scene, shapes, options);
  };
}

std::vector<belief::Belief> tracked_push(const Push& push, std::uint64_t seed, core::ThreadPool& threads) {
  const auto scene = push_scene(push);
  belief::WorldState start = belief::mean_start(*scene);
  start.objects[0].physical.friction = start.objects[0].physical.impact_friction = push.friction;
  start.objects[0].physical.mass = push.mass;
  simulation::RunRequest request;
  request.stop.duration = push.frames * kFrame;
  request.stop.stop_at_rest = false;
  request.sample_interval = kFrame;
  const auto simulator = push_simulators()(*scene, 1.0);
  PRESCENE_CHECK_MSG(simulator.ok(), simulator.status().message());
  std::vector<belief::Trajectory> runs(1);
  (*simulator)->run(std::span(&start, 1), request, core::RandomStream(seed, core::Purpose::kTest), 0, threads, runs);

  core::RandomStream noise(seed, core::Purpose::kSensorNoise);
  std::vector<belief::Belief> beliefs;
  for (int frame = 0; frame < push.frames; ++frame) {
    belief::Belief& belief = beliefs.emplace_back();
    belief.step = static_cast<std::uint64_t>(frame + 1);
    belief.seed = seed;
    belief.stamp_ns = 1'000'000'000 + static_cast<core::TimeNs>(std::llround(1e9 * frame * kFrame));
    belief.scene = scene;
    belief.robot = {belief::pose_at(scene->robot[0], frame * kFrame)};
    belief::Particle particle;
    geometry::Vector6d d;
    for (int i = 0; i < 6; ++i) d[i] = noise.normal() * (i < 3 ? push.turn_noise : push.shift_noise);
    const auto& states = runs[0].states;
    const auto at = std::min<std::size_t>(static_cast<std::size_t>(frame), states.size() - 1);
    particle.X_WO = geometry::box_plus(states[at].objects[0].X_WO, d);
    particle.covariance.diagonal().head<3>().setConstant(push.turn_noise * push.turn_noise);
    particle.covariance.diagonal().segment<3>(3).setConstant(push.shift_noise * push.shift_noise);
    belief::ObjectBelief object;
    object.name = "box";
    object.particles = {particle};
    object.state = belief::TrackState::kTracked;
    belief.objects = {object};
  }
  return beliefs;
}

}  // namespace prescene::filter_tests
