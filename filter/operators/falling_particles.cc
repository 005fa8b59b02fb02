// SPDX-License-Identifier: Apache-2.0
#include "falling_particles.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/mesh_facts.h"

namespace prescene::filter {
namespace {

using belief::MotionMode;
using belief::ObjectBelief;
using belief::Particle;

constexpr double kSettleSpeed = 0.04;       // m/s; what is slower than this ...
constexpr double kSettleRate = 0.5;         // rad/s; ... and this may come to rest
constexpr double kStayedShift = 1e-3;       // m; what the simulator moves by less in a step ...
constexpr double kStayedTurn = 0.01;        // rad; ... and turns by less has stayed where it is
constexpr double kFarAboveRounding = 1e-9;  // m
constexpr double kPushedSpeed = 0.08;  // m/s, across gravity; what rests is pushed when a simulation makes it as fast
constexpr double kPushedRate = 1.0;    // rad/s

/// The scene of one step: robot bodies go from where they were to where they are, absent objects are left out.
belief::Scene step_scene(const belief::Belief& belief, std::span<const Pose> X_WG, double dt,
                         const std::vector<std::size_t>& objects) {
  belief::Scene scene = *belief.scene;
  for (std::size_t i = 0; i < scene.robot.size(); ++i)
    scene.robot[i].timeline = {{0.0, belief.robot[i]}, {dt, X_WG[i]}};
  std::vector<belief::SceneObject> kept;
  for (const std::size_t i : objects) kept.push_back(belief.scene->objects[i]);
  scene.objects = std::move(kept);
  keep_joints_of_present(scene);
  scene.actions.clear();
  scene.outcomes.clear();
  scene.exclusive_outcomes.clear();
  return scene;
}

double lowest_point(const std::vector<belief::CollisionShape>& shapes, const Pose& X_W, const Vector3d& up_W) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const belief::CollisionShape& shape : shapes) {
    const auto* of_mesh = std::get_if<belief::MeshShape>(&shape);
    if (of_mesh == nullptr) {
      for (const Vector3d& vertex : belief::collision_mesh({shape}).vertices)
        lowest = std::min(lowest, up_W.dot(X_W * vertex));
      continue;
    }
    // A scanned table has 100,000 vertices: first which are lowest, to far more than rounding, and then how low.
    const Vector3d up_S = (X_W * of_mesh->X_OS).rotation.conjugate() * up_W;
    double about = std::numeric_limits<double>::infinity();
    for (const Vector3d& vertex : of_mesh->mesh->vertices) about = std::min(about, up_S.dot(vertex));
    for (const Vector3d& vertex : of_mesh->mesh->vertices)
      if (up_S.dot(vertex) < about + kFarAboveRounding)
        lowest = std::min(lowest, up_W.dot(X_W * (of_mesh->X_OS * vertex)));
  }
  return lowest;
}

/// Where everything stops that falls past all that is known: a floor at the height of the lowest surface that was seen
/// or of the lowest known support, whichever is lower. What is below that already stops where it is, and the belief
/// remembers that height.
std::optional<belief::Support> last_floor(std::span<const Falling> falling, belief::Belief& belief) {
  const belief::Scene& scene = *belief.scene;
  if (!belief.lowest_seen || !(scene.gravity_W.norm() > 0.0)) return std::nullopt;
  const Vector3d up_W = -scene.gravity_W.normalized();
  double height = *belief.lowest_seen;
  for (const belief::Support& support : scene.supports)
    height = std::min(height, lowest_point(support.collision, support.X_WS, up_W));
  Vector3d middle = Vector3d::Zero();
  for (const Falling& f : falling) {
    const Particle& particle = belief.objects[f.object].particles[f.particle];
    middle += particle.X_WO.translation / static_cast<double>(falling.size());
    if (up_W.dot(particle.X_WO.translation) >= height) continue;
    const belief::ObjectModel& model = belief::model_of(belief, belief.objects[f.object]);
    const double reach = model.visual ? geometry::facts_of(model.visual).reach : 0.0;
    height = up_W.dot(particle.X_WO.translation) - reach;
    belief.lowest_seen = height;
  }
  constexpr double kThickness = 1.0, kSize = 40.0;  // m: nothing leaves it sideways, nor passes it in a step
  belief::Support floor;
  floor.name = "last_floor";
  while (belief::find_support(scene, floor.name)) floor.name += '_';
  floor.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{Vector3d(kSize, kSize, kThickness)}, {}});
  floor.X_WS.rotation = geometry::rotation_between(Vector3d::UnitZ(), up_W);
  floor.X_WS.translation = middle + up_W * (height - 0.5 * kThickness - up_W.dot(middle));
  floor.contact.friction = belief::FixedScalar{1.0};
  return floor;
}

/// Constant velocity in place of physics.
void go_on_without_physics(const Falling& falling, const std::string& why, belief::Belief& belief,
                           PredictReport& report) {
  Particle& particle = belief.objects[falling.object].particles[falling.particle];
  particle.X_WO = falling.X_WO;
  particle.V_WO = falling.V_WO;
  if (report.not_simulated++ == 0) report.failure = why;
}

/// Why the end of a run is no prediction; nothing where it is one.
std::optional<std::string> failure_of(const belief::Trajectory& run, std::size_t place) {
  switch (run.end) {
    case belief::TrajectoryEnd::kDuration:
      break;
    case belief::TrajectoryEnd::kDiverged:
      return "diverged";
    case belief::TrajectoryEnd::kLeftTheWorld:
      return "left the simulated world";
    case belief::TrajectoryEnd::kAtRest:
    case belief::TrajectoryEnd::kCancelled:
    case belief::TrajectoryEnd::kDecided:
      return "ended before the step did";
  }
  if (run.states.empty() || place >= run.final().objects.size()) return "has no end";
  const belief::ObjectState& end = run.final().objects[place];
  const bool finite = end.X_WO.is_finite() && end.V_WO.linear.allFinite() && end.V_WO.angular.allFinite();
  return finite ? std::nullopt : std::optional<std::string>("has no finite end");
}

/// What rests begins to move where something in its world has set it in motion. What falls onto its support from as
/// little above it as poses are uncertain is not pushed.
void take_if_pushed(const belief::ObjectState& end, const Vector3d& gravity_W, const PredictOptions& options,
                    Particle& particle, PredictReport& report) {
  if (particle.mode == MotionMode::kHeld) return;
  const Vector3d up_W = gravity_W.norm() > 0.0 ? Vector3d(gravity_W.normalized()) : Vector3d::Zero();
  const Vector3d across = end.V_WO.linear - up_W * up_W.dot(end.V_WO.linear);
  if (across.norm() < kPushedSpeed && end.V_WO.angular.norm() < kPushedRate) return;
  particle.X_WO = geometry::normalized(end.X_WO);
  particle.V_WO = end.V_WO;
  if (particle.mode == MotionMode::kResting) wake(options, particle);
  ++report.pushed;
}

/// Moves falling particles of one duration by the simulator, each with the other objects (`objects`, by index in the
/// belief) where they most likely are. Its physical parameters are drawn anew for each particle and step from what is
/// believed of them, and so are those of the joints.
///
/// In worlds the other members are where they are in the particle's, and one simulation moves them all.
void simulate(belief::Belief& belief, std::span<const Falling> falling, const Worlds& worlds,
              const std::vector<std::size_t>& objects, const std::vector<belief::Joint>& joints, double dt,
              const PredictOptions& options, const simulation::Simulator& simulator, const PredictTools& tools,
              PredictReport& report) {
  belief::WorldState common;
  std::vector<belief::PhysicalSampler> physics;
  for (const std::size_t i : objects) {
    const ObjectBelief& object = belief.objects[i];
    const Particle& particle = belief::heaviest(object.particles);
    physics.emplace_back(belief::model_of(belief, object), object.physics);
    common.objects.push_back({particle.X_WO, particle.V_WO, particle.mode, physics.back().mean()});
  }
  const core::RandomStream parameters = tools.stream.for_purpose(core::Purpose::kParameters);
  const auto place_of = [&](std::size_t object) {
    return static_cast<std::size_t>(std::find(objects.begin(), objects.end(), object) - objects.begin());
  };
  std::vector<belief::WorldState> starts;
  std::vector<double> settle_draws;
  std::vector<std::size_t> run_of;
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> run_of_world;  // by an island's first member
  for (const Falling& f : falling) {
    const WorldsOfIsland* island = worlds.of(f.object);
    if (island != nullptr && island->apart) island = nullptr;
    const auto [entry, is_new] =
        run_of_world.try_emplace({island != nullptr ? island->members.front() : f.object, f.particle}, starts.size());
    run_of.push_back(entry->second);
    if (is_new) {
      starts.push_back(common);
      starts.back().time = dt - f.duration;
      for (std::size_t place = 0; island != nullptr && place < objects.size(); ++place)
        if (const Particle* at = island->start_of(objects[place], f.particle)) {
          belief::ObjectState& state = starts.back().objects[place];
          state.X_WO = at->X_WO;
          state.V_WO = at->V_WO;
          state.mode = at->mode;
        }
    }
    belief::WorldState& start = starts[entry->second];
    const Particle& particle = belief.objects[f.object].particles[f.particle];
    const std::size_t place = place_of(f.object);
    core::RandomStream draws = parameters.at(belief.step, static_cast<std::uint32_t>(f.object << 16 | f.particle));
    std::vector<double> uniforms(static_cast<std::size_t>(physics[place].dimensions()));
    for (double& u : uniforms) u = draws.uniform();
    settle_draws.push_back(draws.uniform());
    for (std::size_t j = 0; is_new && j < joints.size(); ++j) {
      const belief::Joint& joint = joints[j];
      const auto drawn = [&](const belief::ScalarDistribution& distribution) {
        std::vector<double> numbers(static_cast<std::size_t>(belief::dimensions(distribution)));
        for (double& u : numbers) u = draws.uniform();
        return belief::draw(distribution, numbers);
      };
      belief::JointParameters& to = start.joints.emplace_back();
      to.type = joint.type;
      to.friction = drawn(joint.friction);
      to.damping = drawn(joint.damping);
    }
    start.objects[place] = {particle.X_WO, particle.V_WO, MotionMode::kMoving, physics[place].draw(uniforms)};
  }
  simulation::RunRequest request;
  request.stop.duration = falling.front().duration;
  request.stop.stop_at_rest = false;
  // The world of a robot has no edge: what is far from its origin falls like everything else.
  request.stop.world_radius = std::numeric_limits<double>::infinity();
  request.actions = belief.pushes;
  for (belief::Action& push : request.actions) push.time -= dt - falling.front().duration;
  std::vector<belief::Trajectory> runs(starts.size());
  simulator.run(starts, request, tools.stream, 0, tools.threads, runs);
  for (std::size_t i = 0; i < falling.size(); ++i) {
    ObjectBelief& object = belief.objects[falling[i].object];
    const std::size_t place = place_of(falling[i].object);
    const belief::Trajectory& run = runs[run_of[i]];
    if (const std::optional<std::string> failure = failure_of(run, place)) {
      go_on_without_physics(falling[i], "the simulated motion of '" + object.name + "' " + *failure, belief, report);
      continue;
    }
    const belief::ObjectState& end = run.final().objects[place];
    Particle& particle = object.particles[falling[i].particle];
    if (falling[i].keeps_pose) {
      take_if_pushed(end, belief.scene->gravity_W, options, particle, report);
      ++report.simulated;
      continue;
    }
    const geometry::Vector6d motion = geometry::box_minus(end.X_WO, particle.X_WO);
    particle.X_WO = geometry::normalized(end.X_WO);
    particle.V_WO = end.V_WO;
    const bool stayed = motion.head<3>().norm() < kStayedTurn && motion.tail<3>().norm() < kStayedShift;
    if (falling[i].covariance_at_rest && stayed && is_slow(particle))
      particle.covariance = *falling[i].covariance_at_rest;
    particle.mode = MotionMode::kMoving;
    const double settles = falling[i].woken ? 1.0 : options.settle_probability;
    if (object.state != belief::TrackState::kTracked && settle_draws[i] < settles && is_slow(particle))
      settle(particle);
    if (falling[i].woken && particle.mode == MotionMode::kMoving) ++report.pushed;
    ++report.simulated;
  }
  for (const auto& [key, run] : run_of_world) {
    const WorldsOfIsland* island = worlds.of(key.first);
    const std::size_t world = key.second;
    if (island == nullptr || island->apart) continue;
    for (const std::size_t member : island->members) {
      const bool falls = std::any_of(falling.begin(), falling.end(), [member, world](const Falling& f) {
        return f.object == member && f.particle == world;
      });
      const std::size_t place = place_of(member);
      if (falls || place == objects.size() || failure_of(runs[run], place)) continue;
      take_if_pushed(runs[run].final().objects[place], belief.scene->gravity_W, options,
                     belief.objects[member].particles[world], report);
    }
  }
}

/// A ball about an object.
struct Ball {
  Vector3d p_W;
  double radius;
};
Ball ball_about(const belief::Belief& belief, const ObjectBelief& object, const Pose& X_WO) {
  return {X_WO * centre_of(*belief.scene, object), radius_of(*belief.scene, object)};
}

/// By falling object, the objects that may have to do with its motion in this step: those that one of its particles
/// may reach, and their islands. Ascending.
std::vector<std::vector<std::size_t>> neighbours_of(const belief::Belief& belief, std::span<const Falling> falling,
                                                    const Worlds& worlds, double dt) {
  constexpr double kMargin = 0.05;  // m: others are at their likeliest poses only
  std::vector<Ball> balls;
  for (const ObjectBelief& object : belief.objects)
    balls.push_back(ball_about(belief, object, belief::heaviest(object.particles).X_WO));
  std::vector<std::set<std::size_t>> near(belief.objects.size());
  for (const Falling& f : falling) {
    const ObjectBelief& object = belief.objects[f.object];
    const Particle& particle = object.particles[f.particle];
    const Vector3d p_W = particle.X_WO * centre_of(*belief.scene, object);
    near[f.object].insert(f.object);
    for (std::size_t j = 0; j < belief.objects.size(); ++j) {
      const double speed =
          particle.V_WO.linear.norm() + belief::heaviest(belief.objects[j].particles).V_WO.linear.norm();
      const double reach = balls[f.object].radius + balls[j].radius + kMargin + speed * dt;
      if (is_present(belief.objects[j]) && (p_W - balls[j].p_W).norm() < reach) near[f.object].insert(j);
    }
  }
  for (const WorldsOfIsland& island : worlds.islands) {
    std::set<std::size_t> all;
    for (const std::size_t member : island.members) all.insert(near[member].begin(), near[member].end());
    if (all.empty() || island.apart) continue;
    all.insert(island.members.begin(), island.members.end());
    for (const std::size_t member : island.members) near[member] = all;
  }
  std::vector<std::vector<std::size_t>> neighbours;
  for (const std::set<std::size_t>& mine : near) {
    std::set<int> islands;
    for (const std::size_t j : mine) islands.insert(belief.objects[j].island);
    std::vector<std::size_t>& all = neighbours.emplace_back();
    for (std::size_t j = 0; j < belief.objects.size() && !mine.empty(); ++j)
      if (mine.contains(j) || (is_present(belief.objects[j]) && islands.contains(belief.objects[j].island)))
        all.push_back(j);
  }
  return neighbours;
}

/// Moves falling particles whose surroundings are `objects`.
void move_on_among(const std::vector<std::size_t>& objects, std::span<const Falling> falling, const Worlds& worlds,
                   const std::optional<belief::Support>& floor, std::span<const Pose> X_WG, double dt,
                   const PredictOptions& options, const PredictTools& tools, belief::Belief& belief,
                   PredictReport& report) {
  belief::Scene scene = step_scene(belief, X_WG, dt, objects);
  if (floor) scene.supports.push_back(*floor);
  const auto simulator = tools.simulators(scene, 1.0);
  if (!simulator) {
    const std::string why = "no simulator could be made: " + simulator.status().message();
    for (const Falling& f : falling) go_on_without_physics(f, why, belief, report);
    return;
  }
  PRESCENE_CHECK(*simulator != nullptr);
  for (std::size_t begin = 0; begin < falling.size();) {
    std::size_t end = begin;
    while (end < falling.size() && falling[end].duration == falling[begin].duration) ++end;
    simulate(belief, falling.subspan(begin, end - begin), worlds, objects, scene.joints, dt, options, **simulator,
             tools, report);
    begin = end;
  }
}

}  // namespace

Vector3d centre_of(const belief::Scene& scene, const ObjectBelief& object) {
  const belief::ObjectModel& model = scene.models[static_cast<std::size_t>(object.model)];
  return model.visual ? geometry::facts_of(model.visual).box.center() : belief::mean(model.center_of_mass);
}

double radius_of(const belief::Scene& scene, const ObjectBelief& object) {
  const belief::ObjectModel& model = scene.models[static_cast<std::size_t>(object.model)];
  return model.visual ? geometry::facts_of(model.visual).radius
                      : geometry::radius_about(belief::collision_mesh(model), centre_of(scene, object));
}

void clear_twist(Particle& particle) {
  particle.V_WO = {};
  particle.covariance.bottomRows<6>().setZero();
  particle.covariance.rightCols<6>().setZero();
}

bool is_slow(const Particle& particle) {
  return particle.V_WO.linear.norm() < kSettleSpeed && particle.V_WO.angular.norm() < kSettleRate;
}

void settle(Particle& particle) {
  particle.mode = MotionMode::kResting;
  clear_twist(particle);
}

void wake(const PredictOptions& options, Particle& particle, double share) {
  const double rate = share * options.wake_rate, speed = share * options.wake_speed;
  particle.mode = MotionMode::kMoving;
  particle.covariance.diagonal().segment<3>(6).array() += rate * rate;
  particle.covariance.diagonal().segment<3>(9).array() += speed * speed;
}

void keep_joints_of_present(belief::Scene& scene) {
  belief::drop_loose_joints(scene);
  for (belief::SceneObject& object : scene.objects)
    if (belief::joint_of(scene, object.name)) object.held_by.reset();
}

PredictReport move_on(belief::Belief& belief, std::vector<Falling> falling, const Worlds& worlds,
                      std::span<const Pose> X_WG, double dt, const PredictOptions& options, const PredictTools& tools) {
  PredictReport report;
  if (falling.empty()) return report;
  const std::optional<belief::Support> floor = last_floor(falling, belief);
  const std::vector<std::vector<std::size_t>> neighbours = neighbours_of(belief, falling, worlds, dt);
  // Particles of the same surroundings share a simulator, and runs of one call a duration.
  std::stable_sort(falling.begin(), falling.end(), [&](const Falling& a, const Falling& b) {
    return std::tie(neighbours[a.object], a.duration) < std::tie(neighbours[b.object], b.duration);
  });
  for (std::size_t begin = 0; begin < falling.size();) {
    const std::vector<std::size_t>& objects = neighbours[falling[begin].object];
    std::size_t end = begin;
    while (end < falling.size() && neighbours[falling[end].object] == objects) ++end;
    move_on_among(objects, std::span(falling).subspan(begin, end - begin), worlds, floor, X_WG, dt, options, tools,
                  belief, report);
    begin = end;
  }
  return report;
}

}  // namespace prescene::filter
