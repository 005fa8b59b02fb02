// SPDX-License-Identifier: Apache-2.0
#include "tests/filter/pushed_box.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "prescene/geometry/sampling.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
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

belief::ObjectModel box_model() {
  belief::ObjectModel box;
  box.name = "box";
  box.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{kBox}, Pose::identity()});
  box.contact.friction = belief::UniformScalar{0.1, 0.9};
  box.mass = belief::NormalScalar{0.4, 0.05, 0.2, 0.6};
  return *belief::with_derived_properties(box);
}

belief::Support box_support(const char* name, const Vector3d& size, const Pose& X_WS) {
  belief::Support support;
  support.name = name;
  support.collision.push_back(
      belief::PrimitiveShape{geometry::BoxShape{size}, Pose::from_translation({0.0, 0.0, -0.5 * size.z()})});
  support.X_WS = X_WS;
  support.contact.friction = belief::FixedScalar{1.0};
  return support;
}

std::vector<belief::WorldState> simulated(const belief::Scene& scene, const belief::WorldState& start, double duration,
                                          double interval, std::uint64_t seed, core::ThreadPool& threads) {
  simulation::RunRequest request;
  request.stop.duration = duration;
  request.stop.stop_at_rest = false;
  request.sample_interval = interval;
  simulation::ShapeStore shapes;
  const auto simulator = simulation::make_bullet_simulator(scene, shapes);
  PRESCENE_CHECK_MSG(simulator.ok(), simulator.status().message());
  std::vector<belief::Trajectory> runs(1);
  (*simulator)->run(std::span(&start, 1), request, core::RandomStream(seed, core::Purpose::kTest), 0, threads, runs);
  return runs[0].states;
}

/// What a tracker reports of a box frame by frame. Errors of neighbouring frames are alike, as surfaces that are seen
/// partly pull all of them the same way: an Ornstein-Uhlenbeck process.
class TrackedBox {
 public:
  TrackedBox(double turn_noise, double shift_noise, double interval, std::uint64_t seed)
      : noise_(seed, core::Purpose::kSensorNoise), kept_(std::exp(-interval / kErrorTime)) {
    deviation_ << Vector3d::Constant(turn_noise), Vector3d::Constant(shift_noise);
    for (int i = 0; i < 6; ++i) error_[i] = noise_.normal();
  }

  belief::ObjectBelief at(const Pose& X_WO) {
    for (int i = 0; i < 6; ++i) error_[i] = kept_ * error_[i] + std::sqrt(1.0 - kept_ * kept_) * noise_.normal();
    belief::Particle particle;
    particle.X_WO = geometry::box_plus(X_WO, error_.cwiseProduct(deviation_));
    particle.covariance.diagonal().head<6>() = deviation_.cwiseAbs2();
    belief::ObjectBelief object;
    object.name = "box";
    object.particles = {particle};
    object.state = belief::TrackState::kTracked;
    return object;
  }

 private:
  static constexpr double kErrorTime = 0.1;  // s

  core::RandomStream noise_;
  double kept_;
  geometry::Vector6d deviation_, error_;
};

belief::Belief frame_of(std::shared_ptr<const belief::Scene> scene, int frame, double interval, std::uint64_t seed) {
  belief::Belief belief;
  belief.step = static_cast<std::uint64_t>(frame + 1);
  belief.seed = seed;
  belief.stamp_ns = 1'000'000'000 + static_cast<core::TimeNs>(std::llround(1e9 * frame * interval));
  belief.robot = {belief::pose_at(scene->robot[0], frame * interval)};
  belief.scene = std::move(scene);
  return belief;
}

}  // namespace

std::shared_ptr<const belief::Scene> push_scene(const Push& push) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "push";
  scene->models.push_back(box_model());
  scene->supports.push_back(box_support("table", {3.0, 3.0, 0.04}, on_slope(push, Vector3d::Zero())));
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
  const std::vector<belief::WorldState> states = simulated(*scene, start, push.frames * kFrame, kFrame, seed, threads);
  TrackedBox tracked(push.turn_noise, push.shift_noise, kFrame, seed);
  std::vector<belief::Belief> beliefs;
  for (int frame = 0; frame < push.frames; ++frame) {
    const auto at = std::min<std::size_t>(static_cast<std::size_t>(frame), states.size() - 1);
    belief::Belief& belief = beliefs.emplace_back(frame_of(scene, frame, kFrame, seed));
    belief.objects = {tracked.at(states[at].objects[0].X_WO)};
  }
  return beliefs;
}

std::shared_ptr<const belief::Scene> drop_scene(const Drop& drop) {
  constexpr double kTop = 0.2;  // m, of the block
  auto scene = std::make_shared<belief::Scene>();
  scene->name = "drop";
  belief::ObjectModel box = box_model();
  box.contact.friction = belief::NormalScalar{0.4, 0.1, 0.1, 0.8};
  box.contact.restitution = belief::NormalScalar{0.2, 0.1, 0.0, 0.6};
  box.mass = belief::FixedScalar{0.4};
  scene->models.push_back(*belief::with_derived_properties(box));
  scene->supports.push_back(box_support("table", {3.0, 3.0, 0.04}, Pose::identity()));
  scene->supports.push_back(box_support("block", {0.2, 0.3, kTop}, Pose::from_translation({-0.1, 0.0, kTop})));
  const Vector3d p(drop.over, 0.0, kTop + drop.height + 0.5 * kBox.z());
  belief::KinematicBody hand;
  hand.name = "hand";
  hand.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{kPusher}, Pose::identity()});
  hand.timeline = {{0.0, Pose::from_translation(p + Vector3d(0.0, 0.0, 0.2))}};
  scene->robot.push_back(hand);
  belief::SceneObject object;
  object.name = "box";
  object.pose = belief::FixedPose{Pose{geometry::exp_rotation({0.0, drop.tilt, 0.0}), p}};
  object.held_by = "hand";
  scene->objects.push_back(object);
  return scene;
}

std::vector<belief::Belief> tracked_drop(const Drop& drop, std::uint64_t seed, core::ThreadPool& threads) {
  constexpr double kInterval = 1.0 / 15.0, kSpeedError = 0.05, kTurnError = 0.3;
  const auto held = drop_scene(drop);
  auto free = std::make_shared<belief::Scene>(*held);
  free->objects[0].held_by.reset();
  core::RandomStream noise(seed, core::Purpose::kParameters);
  TrackedBox tracked(0.008, 0.0015, kInterval, seed);
  belief::WorldState start = belief::mean_start(*free);
  belief::ObjectState& box = start.objects[0];
  box.physical.friction = box.physical.impact_friction = drop.friction;
  box.physical.restitution = drop.restitution;
  for (int k = 0; k < 3; ++k) {
    box.V_WO.linear[k] = kSpeedError * noise.normal();
    box.V_WO.angular[k] = kTurnError * noise.normal();
  }
  const int release = drop.frames / 5;
  const std::vector<belief::WorldState> states =
      simulated(*free, start, (drop.frames - release) * kInterval, kInterval, seed, threads);
  std::vector<belief::Belief> beliefs;
  for (int frame = 0; frame < drop.frames; ++frame) {
    const auto at = std::min<std::size_t>(static_cast<std::size_t>(std::max(0, frame - release)), states.size() - 1);
    belief::Belief& belief = beliefs.emplace_back(frame_of(frame < release ? held : free, frame, kInterval, seed));
    belief.objects = {tracked.at(states[at].objects[0].X_WO)};
  }
  return beliefs;
}

}  // namespace prescene::filter_tests
