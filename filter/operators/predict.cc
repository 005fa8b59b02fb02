// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/predict.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

using belief::MotionMode;
using belief::ObjectBelief;
using belief::Particle;
using geometry::Matrix3d;
using geometry::Twist;

/// Adds the noise of dt, in the error coordinates (rotation, translation, angular, linear).
void add_noise(const MotionNoise& noise, double dt, belief::Matrix12d& covariance) {
  const double shares[] = {noise.turn, noise.shift, noise.rate, noise.speed};
  for (int block = 0; block < 4; ++block)
    covariance.diagonal().segment<3>(3 * block).array() += shares[block] * shares[block] * dt;
}

/// Scales rows and columns so that no standard deviation exceeds its limit; correlations stay.
void limit_spread(const PredictOptions& options, belief::Matrix12d& covariance) {
  const double limits[] = {options.max_turn_deviation, options.max_shift_deviation, options.max_rate_deviation,
                           options.max_speed_deviation};
  Eigen::Matrix<double, 12, 1> scale = Eigen::Matrix<double, 12, 1>::Ones();
  for (int i = 0; i < 12; ++i) {
    const double deviation = std::sqrt(std::max(0.0, covariance(i, i)));
    if (deviation > limits[i / 3]) scale[i] = limits[i / 3] / deviation;
  }
  covariance = scale.asDiagonal() * covariance * scale.asDiagonal();
}

void clear_twist(Particle& particle) {
  particle.V_WO = {};
  particle.covariance.bottomRows<6>().setZero();
  particle.covariance.rightCols<6>().setZero();
}

bool is_slow(const PredictOptions& options, const Particle& particle) {
  return particle.V_WO.linear.norm() < options.settle_speed && particle.V_WO.angular.norm() < options.settle_rate;
}

void settle(Particle& particle) {
  particle.mode = MotionMode::kResting;
  clear_twist(particle);
}

/// Starts to move: at its velocity, with room for more.
void wake(const PredictOptions& options, Particle& particle) {
  particle.mode = MotionMode::kMoving;
  particle.covariance.diagonal().segment<3>(6).array() += options.wake_rate * options.wake_rate;
  particle.covariance.diagonal().segment<3>(9).array() += options.wake_speed * options.wake_speed;
}

/// The motion of a body between two poses as a twist.
Twist twist_between(const Pose& X_from, const Pose& X_to, double dt) {
  Twist V;
  V.angular = geometry::log_rotation(X_to.rotation * X_from.rotation.conjugate()) / dt;
  V.linear = (X_to.translation - X_from.translation) / dt;
  return V;
}

/// Rigidly with the hand from one of its poses to another; the twist is that of the motion.
void carry(Particle& particle, const Pose& X_WG_from, const Pose& X_WG_to, double dt) {
  const Pose before = particle.X_WO;
  const Pose motion = X_WG_to * X_WG_from.inverse();
  particle.X_WO = geometry::normalized(motion * before);
  clear_twist(particle);
  particle.V_WO = twist_between(before, particle.X_WO, dt);
  // Rotation errors are the body's own and stay; translation errors turn with the hand.
  belief::Matrix12d turn = belief::Matrix12d::Identity();
  turn.block<3, 3>(3, 3) = motion.rotation.toRotationMatrix();
  particle.covariance = turn * particle.covariance * turn.transpose();
}

/// When within the step (s from its start) the object is let go of, if it is not grasped again after that.
std::optional<double> release_time(const belief::Control& control, const belief::Scene& scene,
                                   const std::string& object, double dt) {
  std::optional<double> time;
  for (const belief::Action& action : control.actions) {
    const auto* release = std::get_if<belief::Release>(&action.what);
    const auto* grasp = std::get_if<belief::Grasp>(&action.what);
    if (release != nullptr && release->object == object && !time) time = std::clamp(action.time, 0.0, dt);
    if (grasp != nullptr && grasp->object == object && belief::find_robot_body(scene, grasp->hand)) time.reset();
  }
  return time;
}

/// The scene with the object held by this hand, or by none (a copy: the context of earlier beliefs stays as it was).
void set_holder(std::size_t object, const std::optional<std::string>& hand, belief::Belief& belief) {
  if (belief.scene->objects[object].held_by == hand) return;
  auto scene = std::make_shared<belief::Scene>(*belief.scene);
  scene->objects[object].held_by = hand;
  belief.scene = std::move(scene);
}

/// Puts the grasps of the control into the scene.
void apply_grasps(const belief::Control& control, belief::Belief& belief) {
  for (const belief::Action& action : control.actions) {
    const auto* grasp = std::get_if<belief::Grasp>(&action.what);
    if (grasp == nullptr) continue;
    const auto object = belief::find_object(*belief.scene, grasp->object);
    if (!object || !belief::find_robot_body(*belief.scene, grasp->hand)) continue;
    const auto index = static_cast<std::size_t>(*object);
    set_holder(index, grasp->hand, belief);
    for (Particle& particle : belief.objects[index].particles) {
      particle.mode = MotionMode::kHeld;
      clear_twist(particle);
    }
  }
}

bool present(const ObjectBelief& object) {
  return object.existence >= 0.5 && object.state != belief::TrackState::kLost;
}

/// One particle that physics is to move on.
struct Falling {
  std::size_t object;
  std::size_t particle;
  double duration;  ///< s
  Pose X_WO;        ///< Where constant velocity takes it, ...
  Twist V_WO;       ///< ... and how fast it is then.
};

/// The scene of one step: robot bodies go from where they were to where they are, absent objects are left out.
belief::Scene step_scene(const belief::Belief& belief, std::span<const Pose> X_WG, double dt,
                         const std::vector<std::size_t>& objects) {
  belief::Scene scene = *belief.scene;
  for (std::size_t i = 0; i < scene.robot.size(); ++i)
    scene.robot[i].timeline = {{0.0, belief.robot[i]}, {dt, X_WG[i]}};
  std::vector<belief::SceneObject> kept;
  for (const std::size_t i : objects) kept.push_back(belief.scene->objects[i]);
  scene.objects = std::move(kept);
  scene.actions.clear();
  scene.outcomes.clear();
  scene.exclusive_outcomes.clear();
  return scene;
}

double lowest_point(const std::vector<belief::CollisionShape>& shapes, const Pose& X_W, const Vector3d& up_W) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vector3d& vertex : belief::collision_mesh(shapes).vertices)
    lowest = std::min(lowest, up_W.dot(X_W * vertex));
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
    const double reach = model.visual ? geometry::radius_about(*model.visual, Vector3d::Zero()) : 0.0;
    height = up_W.dot(particle.X_WO.translation) - reach;
    belief.lowest_seen = height;
  }
  constexpr double kThickness = 1.0, kSize = 40.0;  // m: nothing leaves it sideways, nor passes it in a step
  belief::Support floor;
  floor.name = "last_floor";
  while (belief::find_support(scene, floor.name)) floor.name += '_';
  floor.collision.push_back(belief::PrimitiveShape{geometry::BoxShape{Vector3d(kSize, kSize, kThickness)}, {}});
  floor.X_WS.rotation = geometry::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up_W);
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

/// Moves falling particles of one duration by the simulator, each with the other objects (`objects`, by index in the
/// belief) where they most likely are. Its physical parameters are drawn anew for each particle and step from what is
/// believed of them.
void simulate(belief::Belief& belief, std::span<const Falling> falling, const std::vector<std::size_t>& objects,
              double dt, const PredictOptions& options, const simulation::Simulator& simulator,
              const core::RandomStream& stream, core::ThreadPool& threads, PredictReport& report) {
  belief::WorldState common;
  std::vector<belief::PhysicalSampler> physics;
  for (const std::size_t i : objects) {
    const ObjectBelief& object = belief.objects[i];
    const Particle& particle = belief::heaviest(object.particles);
    physics.emplace_back(belief::model_of(belief, object), object.physics);
    common.objects.push_back({particle.X_WO, particle.V_WO, particle.mode, physics.back().mean()});
  }
  const core::RandomStream parameters = stream.for_purpose(core::Purpose::kParameters);
  const auto place_of = [&](const Falling& f) {
    return static_cast<std::size_t>(std::find(objects.begin(), objects.end(), f.object) - objects.begin());
  };
  std::vector<belief::WorldState> starts;
  std::vector<double> settle_draws;
  for (const Falling& f : falling) {
    belief::WorldState start = common;
    start.time = dt - f.duration;
    const Particle& particle = belief.objects[f.object].particles[f.particle];
    const std::size_t place = place_of(f);
    core::RandomStream draws = parameters.at(belief.step, static_cast<std::uint32_t>(f.object << 16 | f.particle));
    std::vector<double> uniforms(static_cast<std::size_t>(physics[place].dimensions()));
    for (double& u : uniforms) u = draws.uniform();
    settle_draws.push_back(draws.uniform());
    start.objects[place] = {particle.X_WO, particle.V_WO, MotionMode::kMoving, physics[place].draw(uniforms)};
    starts.push_back(std::move(start));
  }
  simulation::RunRequest request;
  request.stop.duration = falling.front().duration;
  request.stop.stop_at_rest = false;
  // The world of a robot has no edge: what is far from its origin falls like everything else.
  request.stop.world_radius = std::numeric_limits<double>::infinity();
  std::vector<belief::Trajectory> runs(starts.size());
  simulator.run(starts, request, stream, 0, threads, runs);
  for (std::size_t i = 0; i < falling.size(); ++i) {
    ObjectBelief& object = belief.objects[falling[i].object];
    const std::size_t place = place_of(falling[i]);
    if (const std::optional<std::string> failure = failure_of(runs[i], place)) {
      go_on_without_physics(falling[i], "the simulated motion of '" + object.name + "' " + *failure, belief, report);
      continue;
    }
    const belief::ObjectState& end = runs[i].final().objects[place];
    Particle& particle = object.particles[falling[i].particle];
    particle.X_WO = geometry::normalized(end.X_WO);
    particle.V_WO = end.V_WO;
    if (object.state != belief::TrackState::kTracked && settle_draws[i] < options.settle_probability &&
        is_slow(options, particle))
      settle(particle);
    ++report.simulated;
  }
}

/// Moves all falling particles on: by physics where that can be done.
PredictReport move_on(belief::Belief& belief, std::vector<Falling> falling, std::span<const Pose> X_WG, double dt,
                      const PredictOptions& options, const simulation::SimulatorFactory& simulators,
                      const core::RandomStream& stream, core::ThreadPool& threads) {
  PredictReport report;
  if (falling.empty()) return report;
  std::vector<std::size_t> objects;
  for (std::size_t i = 0; i < belief.objects.size(); ++i)
    if (present(belief.objects[i])) objects.push_back(i);
  belief::Scene scene = step_scene(belief, X_WG, dt, objects);
  if (auto floor = last_floor(falling, belief)) scene.supports.push_back(*std::move(floor));
  const auto simulator = simulators(scene, 1.0);
  if (!simulator) {
    const std::string why = "no simulator could be made: " + simulator.status().message();
    for (const Falling& f : falling) go_on_without_physics(f, why, belief, report);
    return report;
  }
  PRESCENE_CHECK(*simulator != nullptr);
  // Runs of one call share a duration.
  std::stable_sort(falling.begin(), falling.end(),
                   [](const auto& a, const auto& b) { return a.duration < b.duration; });
  for (std::size_t begin = 0; begin < falling.size();) {
    std::size_t end = begin;
    while (end < falling.size() && falling[end].duration == falling[begin].duration) ++end;
    simulate(belief, std::span(falling).subspan(begin, end - begin), objects, dt, options, **simulator, stream, threads,
             report);
    begin = end;
  }
  return report;
}

Vector3d centre_of(const belief::Scene& scene, const ObjectBelief& object) {
  const belief::ObjectModel& model = scene.models[static_cast<std::size_t>(object.model)];
  return model.visual ? geometry::bounding_box(*model.visual).center() : belief::mean(model.center_of_mass);
}

/// The modes of one object's particles for this step.
void change_modes(const PredictOptions& options, bool tracked, bool in_hand, bool has_physics,
                  core::RandomStream& stream, ObjectBelief& object) {
  for (Particle& particle : object.particles) {
    const double draw = stream.uniform();
    if (in_hand && particle.mode != MotionMode::kHeld) {
      // It may have slipped, but a hand that has not let go carries it on.
      if (draw < options.regrasp_probability) {
        particle.mode = MotionMode::kHeld;
        clear_twist(particle);
      }
    } else if (particle.mode != MotionMode::kMoving) {
      // What is hidden gives no reason to think that it moves.
      if (tracked && draw < options.wake_probability) wake(options, particle);
    } else if ((tracked || !has_physics) && draw < options.settle_probability && is_slow(options, particle)) {
      settle(particle);  // What is not tracked does so where physics leaves it slow, not at the top of its flight.
    }
  }
}

}  // namespace

std::optional<int> holder_of(const belief::Scene& scene, int object) {
  const auto& held_by = scene.objects[static_cast<std::size_t>(object)].held_by;
  return held_by ? belief::find_robot_body(scene, *held_by) : std::nullopt;
}

void drift(Particle& particle, const Vector3d& p_OQ, double dt, double velocity_keep, const MotionNoise& noise) {
  const Vector3d p_OQ_W = particle.X_WO.rotation * p_OQ;
  const Twist V_Q = geometry::shifted(particle.V_WO, p_OQ_W);
  const Vector3d p_WQ = particle.X_WO.translation + p_OQ_W + dt * V_Q.linear;
  const Matrix3d R_OW = particle.X_WO.rotation.toRotationMatrix().transpose();
  Pose moved;
  moved.rotation = (geometry::exp_rotation(dt * V_Q.angular) * particle.X_WO.rotation).normalized();
  moved.translation = p_WQ - moved.rotation * p_OQ;
  particle.X_WO = geometry::normalized(moved);

  const double keep = std::pow(velocity_keep, dt);
  Twist kept;
  kept.angular = keep * V_Q.angular;
  kept.linear = keep * V_Q.linear;
  particle.V_WO = geometry::shifted(kept, -(particle.X_WO.rotation * p_OQ));

  // To first order: a rate turns the body (in its own axes), a velocity moves it.
  belief::Matrix12d F = belief::Matrix12d::Identity();
  F.block<3, 3>(0, 6) = dt * R_OW;
  F.block<3, 3>(3, 9) = dt * Matrix3d::Identity();
  F.diagonal().tail<6>().setConstant(keep);
  particle.covariance = F * particle.covariance * F.transpose();
  add_noise(noise, dt, particle.covariance);
}

PredictReport predict(belief::Belief& belief, const belief::Control& control, std::span<const Pose> X_WG, double dt,
                      const PredictOptions& options, const simulation::SimulatorFactory& simulators,
                      const core::RandomStream& stream, core::ThreadPool& threads) {
  PRESCENE_CHECK(belief.objects.size() == belief.scene->objects.size());
  PRESCENE_CHECK(X_WG.size() == belief.scene->robot.size() && belief.robot.size() == X_WG.size());
  PRESCENE_CHECK(dt > 0.0);
  apply_grasps(control, belief);

  std::vector<Falling> falling;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    ObjectBelief& object = belief.objects[i];
    const bool tracked = object.state == belief::TrackState::kTracked;
    const std::optional<int> hand = holder_of(*belief.scene, static_cast<int>(i));
    const std::optional<double> released = release_time(control, *belief.scene, object.name, dt);
    core::RandomStream draws = stream.at(belief.step, static_cast<std::uint32_t>(i));
    change_modes(options, tracked, hand.has_value(), static_cast<bool>(simulators), draws, object);
    const Vector3d centre = centre_of(*belief.scene, object);
    for (std::size_t k = 0; k < object.particles.size(); ++k) {
      Particle& particle = object.particles[k];
      double left = dt;
      const double physics_draw = draws.uniform();
      double physics_share = tracked ? options.physics_share : options.unseen_physics_share;
      if (particle.mode == MotionMode::kHeld && hand) {
        const Pose& X_from = belief.robot[static_cast<std::size_t>(*hand)];
        const Pose& X_to = X_WG[static_cast<std::size_t>(*hand)];
        const double held = released.value_or(dt);
        if (held > 0.0) carry(particle, X_from, geometry::interpolate(X_from, X_to, held / dt), held);
        add_noise(options.held, dt, particle.covariance);
        if (!released) continue;
        wake(options, particle);
        left = dt - held;
        physics_share = options.physics_after_release;
      } else if (particle.mode == MotionMode::kHeld) {
        wake(options, particle);  // nobody holds it
      }
      if (particle.mode == MotionMode::kResting) {
        add_noise(options.resting, dt, particle.covariance);
      } else if (left > 0.0) {
        const Particle before = particle;
        drift(particle, centre, left, tracked ? options.velocity_keep : options.unseen_velocity_keep, options.moving);
        if (simulators && present(object) && physics_draw < physics_share) {
          falling.push_back({i, k, left, particle.X_WO, particle.V_WO});
          particle.X_WO = before.X_WO;  // physics moves the mean; the spread grows alike
          particle.V_WO = before.V_WO;
        }
      }
      limit_spread(options, particle.covariance);
    }
    if (released) set_holder(i, std::nullopt, belief);
  }
  PredictReport report = move_on(belief, std::move(falling), X_WG, dt, options, simulators, stream, threads);
  belief.robot.assign(X_WG.begin(), X_WG.end());
  return report;
}

}  // namespace prescene::filter
