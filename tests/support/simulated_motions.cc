// SPDX-License-Identifier: Apache-2.0
#include "tests/support/simulated_motions.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "prescene/geometry/sampling.h"

namespace prescene::tests {
namespace {

using geometry::Vector3d;

constexpr double kEdge = 0.1;
constexpr double kUnitInertia = 2.5e-3;
constexpr double kFrame = 1.0 / 120.0;
constexpr double kSeconds = 1.0;

std::vector<SimulatedMotion> recorded(const std::vector<belief::WorldState>& starts,
                                      const simulation::Simulator& simulator, core::RandomStream stream,
                                      core::ThreadPool& pool, const TrackerNoise& noise) {
  simulation::RunRequest request;
  request.stop.duration = kSeconds;
  request.sample_interval = kFrame;
  std::vector<belief::Trajectory> runs(starts.size());
  simulator.run(starts, request, stream, 0, pool, runs);
  std::vector<SimulatedMotion> motions;
  for (const belief::Trajectory& run : runs) {
    SimulatedMotion motion;
    motion.first_contact = kSeconds;
    for (const belief::ContactInterval& contact : run.contacts)
      motion.first_contact = std::min(motion.first_contact, contact.begin);
    for (const belief::WorldState& state : run.states) {
      motion.times.push_back(state.time);
      geometry::Pose X_WO = state.objects[0].X_WO;
      X_WO.translation += noise.position * geometry::normal_vector(stream);
      X_WO.rotation = X_WO.rotation * geometry::exp_rotation(noise.rotation * geometry::normal_vector(stream));
      motion.X_WO.push_back(X_WO);
    }
    motions.push_back(std::move(motion));
  }
  return motions;
}

/// `place` sets where the box is and how it moves, one start after the other.
template <class Place>
std::vector<belief::WorldState> moving_starts(const belief::Scene& scene, int count, const Place& place) {
  std::vector<belief::WorldState> starts(static_cast<std::size_t>(count), belief::mean_start(scene));
  for (belief::WorldState& start : starts) {
    start.objects[0].mode = belief::MotionMode::kMoving;
    place(start.objects[0]);
  }
  return starts;
}

}  // namespace

belief::Scene box_scene(const BoxTruth& truth) {
  belief::Scene scene;
  scene.name = "box on a board";
  belief::ObjectModel box;
  box.name = "box";
  box.collision = {belief::PrimitiveShape{geometry::BoxShape{{kEdge, kEdge, kEdge}}, geometry::Pose{}}};
  box.mass = belief::FixedScalar{0.4};
  box.center_of_mass = belief::Vector3Distribution::fixed(truth.center_of_mass);
  box.unit_inertia = kUnitInertia * std::exp(truth.inertia_size) * geometry::Matrix3d::Identity();
  box.contact.friction = belief::FixedScalar{truth.friction};
  box.contact.impact_friction = belief::FixedScalar{truth.impact_friction};
  box.contact.restitution = belief::FixedScalar{truth.restitution};
  box.contact.edge_radius = truth.edge_radius;
  scene.models.push_back(box);
  belief::SceneObject object;
  object.name = "box";
  scene.objects.push_back(object);
  belief::Support board;
  board.name = "board";
  board.collision = {belief::PrimitiveShape{geometry::BoxShape{{4.0, 4.0, 0.2}}, geometry::Pose{}}};
  board.X_WS = geometry::Pose::from_translation({0.0, 0.0, -0.1});
  board.contact.friction = belief::FixedScalar{1.0};
  board.contact.restitution = belief::FixedScalar{1.0};
  scene.supports.push_back(board);
  return scene;
}

std::string box_scene_yaml(const BoxTruth& truth) {
  const Vector3d& c = truth.center_of_mass;
  const double inertia = kUnitInertia * std::exp(truth.inertia_size);
  std::ostringstream text;
  text << "name: box on a board\nmodels:\n  box:\n    box: [0.1, 0.1, 0.1]\n    mass: 0.4\n"
       << "    center_of_mass: [" << c.x() << ", " << c.y() << ", " << c.z() << "]\n"
       << "    unit_inertia: [" << inertia << ", " << inertia << ", " << inertia << "]\n"
       << "    friction: " << truth.friction << "\n    impact_friction: " << truth.impact_friction
       << "\n    restitution: " << truth.restitution << "\n    edge_radius: " << truth.edge_radius
       << "\nsupports:\n  board:\n    box: [4, 4, 0.2]\n    pose: {position: [0, 0, -0.1]}\n"
       << "    friction: 1\n    restitution: 1\n"
       << "objects:\n  box:\n    model: box\n    pose: {position: [0, 0, 0.3]}\n";
  return text.str();
}

std::vector<SimulatedMotion> simulated_tosses(const belief::Scene& scene, const simulation::Simulator& simulator,
                                              int count, core::RandomStream stream, core::ThreadPool& pool,
                                              const TrackerNoise& noise) {
  const auto starts = moving_starts(scene, count, [&](belief::ObjectState& box) {
    box.X_WO.translation = {0.0, 0.0, stream.uniform(0.25, 0.35)};
    box.X_WO.rotation = geometry::exp_rotation(2.0 * geometry::normal_vector(stream));
    box.V_WO.linear = Vector3d(1.0, 0.0, 0.0) + 0.3 * geometry::normal_vector(stream);
    box.V_WO.angular = 5.0 * geometry::normal_vector(stream);
  });
  return recorded(starts, simulator, stream, pool, noise);
}

std::vector<SimulatedMotion> simulated_spins(const belief::Scene& scene, const simulation::Simulator& simulator,
                                             int count, core::RandomStream stream, core::ThreadPool& pool,
                                             const TrackerNoise& noise) {
  const auto starts = moving_starts(scene, count, [&](belief::ObjectState& ball) {
    ball.X_WO.translation = {0.0, 0.0, stream.uniform(0.15, 0.3)};
    for (double& v : ball.V_WO.linear) v = stream.uniform(-1.0, 1.0);
    for (double& w : ball.V_WO.angular) w = stream.uniform(-20.0, 20.0);
  });
  return recorded(starts, simulator, stream, pool, noise);
}

std::vector<SimulatedMotion> simulated_slides(const belief::Scene& scene, const simulation::Simulator& simulator,
                                              int count, core::RandomStream stream, core::ThreadPool& pool,
                                              const TrackerNoise& noise) {
  const auto starts = moving_starts(scene, count, [&](belief::ObjectState& box) {
    box.X_WO.translation = {0.0, 0.0, 0.5 * kEdge};
    box.X_WO.rotation = geometry::exp_rotation({0.0, 0.0, stream.uniform(-3.0, 3.0)});
    box.V_WO.linear = {stream.uniform(0.8, 1.2), 0.0, 0.0};
    box.V_WO.angular = {0.0, 0.0, stream.uniform(-1.0, 1.0)};
  });
  return recorded(starts, simulator, stream, pool, noise);
}

std::string motion_table(const std::vector<SimulatedMotion>& motions) {
  std::ostringstream text;
  text.precision(9);
  text << "toss,t,x,y,z,qw,qx,qy,qz\n";
  for (std::size_t i = 0; i < motions.size(); ++i) {
    for (std::size_t k = 0; k < motions[i].times.size(); ++k) {
      const Vector3d& p = motions[i].X_WO[k].translation;
      const geometry::Quaterniond& q = motions[i].X_WO[k].rotation;
      text << i << ',' << motions[i].times[k] << ',' << p.x() << ',' << p.y() << ',' << p.z() << ',' << q.w() << ','
           << q.x() << ',' << q.y() << ',' << q.z() << '\n';
    }
  }
  return text.str();
}

}  // namespace prescene::tests
