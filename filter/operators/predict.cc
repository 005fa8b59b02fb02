// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/predict.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "falling_particles.h"
#include "prescene/core/check.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/geometry/mesh_facts.h"
#include "prescene/geometry/sampling.h"

namespace prescene::filter {
namespace {

using belief::MotionMode;
using belief::ObjectBelief;
using belief::Particle;
using geometry::Matrix3d;
using geometry::Twist;

constexpr double kStillTime = 5.0;  // s; what lies still begins to move once in so long, on average
// Of what lies still and is seen, in a hand that stands still too: cameras and supports drift, so that the last hundred
// frames or so count.
constexpr MotionNoise kStillNoise = {.shift = 0.0001, .turn = 0.001, .speed = 0.0, .rate = 0.0};
constexpr double kTwist95 = 12.59;  // 95 % quantile of chi-squared with 6 degrees of freedom
constexpr double kLargestDeviations[] = {1.0, 0.15, 8.0, 1.0};  // rad, m, rad/s, m/s; spreads grow no further
constexpr double kUnseenPhysicsShare = 1.0;   // of what is not tracked: nothing else says where it goes
constexpr double kPhysicsAfterRelease = 1.0;  // in the step in which an object was released
// What is slow mostly stays so, and what begins to move mostly begins slowly: this share of the particles, drawn anew
// in each step, has so much less noise, and this share of those that wake so much less speed.
constexpr double kSmoothShare = 0.5;
constexpr double kSmoothNoise = 0.15;
constexpr double kSlowWake = 0.2;
constexpr double kRestingWakes = 3.0;    // times the probability; they cost next to nothing while nothing moves
constexpr std::size_t kMostPushes = 16;  // that simulators take; the newest count
constexpr double kStillBody = 1e-4;      // m, rad; a body of the robot that moves by less in a step stands still

/// Adds the noise of dt, in the error coordinates (rotation, translation, angular, linear).
void add_noise(const MotionNoise& noise, double dt, belief::Matrix12d& covariance) {
  const double shares[] = {noise.turn, noise.shift, noise.rate, noise.speed};
  for (int block = 0; block < 4; ++block)
    covariance.diagonal().segment<3>(3 * block).array() += shares[block] * shares[block] * dt;
}

/// Scales rows and columns so that no standard deviation exceeds its limit; correlations stay.
void limit_spread(belief::Matrix12d& covariance) {
  Eigen::Matrix<double, 12, 1> scale = Eigen::Matrix<double, 12, 1>::Ones();
  for (int i = 0; i < 12; ++i) {
    const double deviation = std::sqrt(std::max(0.0, covariance(i, i)));
    if (deviation > kLargestDeviations[i / 3]) scale[i] = kLargestDeviations[i / 3] / deviation;
  }
  covariance = scale.asDiagonal() * covariance * scale.asDiagonal();
}

/// Whether what is known of a particle's velocity agrees with none: noise of one frame alone looks like motion.
bool may_be_still(const Particle& particle) {
  if (is_slow(particle)) return true;
  Eigen::Matrix<double, 6, 1> twist;
  twist << particle.V_WO.angular, particle.V_WO.linear;
  const Eigen::Matrix<double, 6, 6> covariance = particle.covariance.bottomRightCorner<6, 6>();
  const geometry::Cholesky6 cholesky(covariance);
  return cholesky.positive_definite() && twist.dot(cholesky.solve(twist)) < kTwist95;
}

MotionNoise scaled(const MotionNoise& noise, double share) {
  return {share * noise.shift, share * noise.turn, share * noise.speed, share * noise.rate};
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

bool stands_still(const Pose& X_WG_from, const Pose& X_WG_to) {
  return geometry::box_minus(X_WG_to, X_WG_from).norm() < kStillBody;
}

/// Something that moves in this step: all of it is, throughout the step, within `reach` of the box, which is fixed in
/// frame M.
struct Mover {
  Pose X_WM;
  geometry::Box box;
  double reach;
};

Vector3d position_of(const belief::Push& push, double since_begin) {
  return push.from + std::clamp(since_begin / push.duration, 0.0, 1.0) * (push.to - push.from);
}

/// Takes the pushes of the control into the belief, with times from the step's start.
void begin_pushes(const belief::Control& control, double dt, belief::Belief& belief) {
  for (const belief::Action& action : control.actions) {
    const auto* push = std::get_if<belief::Push>(&action.what);
    if (push == nullptr || !(push->duration > 0.0) || !(push->radius > 0.0)) continue;
    if (belief.pushes.size() >= kMostPushes) belief.pushes.erase(belief.pushes.begin());
    belief.pushes.push_back(action);
    belief.pushes.back().time = std::clamp(action.time, 0.0, dt);
  }
}

/// The step is over: times are from its end, and what is done is forgotten.
void end_pushes(double dt, belief::Belief& belief) {
  for (belief::Action& action : belief.pushes) action.time -= dt;
  std::erase_if(belief.pushes, [](const belief::Action& action) {
    return action.time + std::get<belief::Push>(action.what).duration <= 0.0;
  });
}

geometry::Box bounds_of(const std::vector<belief::CollisionShape>& shapes) {
  geometry::Box box;
  for (const belief::CollisionShape& shape : shapes) {
    if (const auto* of_mesh = std::get_if<belief::MeshShape>(&shape)) {
      const geometry::Box own = geometry::facts_of(of_mesh->mesh).box;
      for (int corner = 0; corner < 8; ++corner)
        box.extend(of_mesh->X_OS * own.corner(static_cast<geometry::Box::CornerType>(corner)));
    } else {
      for (const Vector3d& vertex : belief::collision_mesh({shape}).vertices) box.extend(vertex);
    }
  }
  return box;
}

/// What is known to move in this step: pushes, and bodies of the robot.
std::vector<Mover> movers_of(const belief::Belief& belief, std::span<const Pose> X_WG, double dt, RobotBounds& bounds) {
  std::vector<Mover> movers;
  for (const belief::Action& action : belief.pushes) {
    const auto& push = std::get<belief::Push>(action.what);
    geometry::Box path(position_of(push, -action.time));
    path.extend(position_of(push, dt - action.time));
    movers.push_back({Pose::identity(), path, push.radius});
  }
  for (std::size_t i = 0; i < X_WG.size(); ++i) {
    if (stands_still(belief.robot[i], X_WG[i])) continue;
    const geometry::Box& box = bounds.of(i, belief.scene->robot[i].collision);
    if (box.isEmpty()) continue;
    // Within the step its corners go no further than from one end to the other.
    double way = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d p_GC = box.corner(static_cast<geometry::Box::CornerType>(corner));
      way = std::max(way, (X_WG[i] * p_GC - belief.robot[i] * p_GC).norm());
    }
    movers.push_back({X_WG[i], box, way});
  }
  return movers;
}

/// Whether one of them may touch the ball in the step.
bool may_touch(const std::vector<Mover>& movers, const Vector3d& p_W, double radius) {
  return std::any_of(movers.begin(), movers.end(), [&](const Mover& mover) {
    return mover.box.exteriorDistance(mover.X_WM.inverse() * p_W) < radius + mover.reach;
  });
}

/// The modes of one object's particles for this step of dt. `smooth`: set for those that begin to move slowly.
void change_modes(const PredictOptions& options, bool seen, bool tracked, bool in_hand, bool has_physics, double dt,
                  core::RandomStream& stream, std::vector<bool>& smooth, ObjectBelief& object) {
  // Of those that rest, a few wake in each frame, evenly among them: what begins to move is followed at once. They
  // weigh as much less as that is more than how often things begin to move.
  const double wakes = std::min(1.0, kRestingWakes * options.wake_probability);
  const double moves = std::min(wakes, dt / kStillTime);
  const bool weighted = seen && wakes > 0.0 && wakes < 1.0;
  const double log_woken = weighted ? std::log(moves / wakes) : 0.0;
  const double log_resting = weighted ? std::log((1.0 - moves) / (1.0 - wakes)) : 0.0;
  double to_wake = stream.uniform();
  bool changed = false;
  for (std::size_t k = 0; k < object.particles.size(); ++k) {
    Particle& particle = object.particles[k];
    const double draw = stream.uniform();
    if (in_hand && particle.mode != MotionMode::kHeld) {
      // It may have slipped, but a hand that has not let go carries it on.
      if (draw < options.regrasp_probability) {
        particle.mode = MotionMode::kHeld;
        clear_twist(particle);
      }
    } else if (particle.mode == MotionMode::kHeld) {
      // What is hidden gives no reason to think that it moves.
      if (tracked && draw < options.wake_probability) wake(options, particle);
    } else if (particle.mode == MotionMode::kResting) {
      if (!seen) continue;
      to_wake += wakes;
      const bool woken = to_wake >= 1.0;
      if (woken) {
        to_wake -= 1.0;
        smooth[k] = draw < kSmoothShare;
        wake(options, particle, smooth[k] ? kSlowWake : 1.0);
      }
      particle.log_weight += woken ? log_woken : log_resting;
      changed = changed || weighted;
    } else if ((tracked || !has_physics) && draw < options.settle_probability && may_be_still(particle)) {
      settle(particle);  // What is not tracked does so where physics leaves it slow, not at the top of its flight.
    }
  }
  if (changed) belief::normalize(object.particles);
}

}  // namespace

const geometry::Box& RobotBounds::of(std::size_t body, const std::vector<belief::CollisionShape>& shapes) {
  if (body >= known_.size()) known_.resize(body + 1);
  Known& known = known_[body];
  if (known.shapes != shapes) known = {shapes, bounds_of(shapes)};
  return known.box;
}

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
                      const PredictOptions& options, const PredictTools& tools, std::span<const Island> islands,
                      const std::vector<bool>& keeps_modes) {
  PRESCENE_CHECK(belief.objects.size() == belief.scene->objects.size());
  PRESCENE_CHECK(X_WG.size() == belief.scene->robot.size() && belief.robot.size() == X_WG.size());
  PRESCENE_CHECK(dt > 0.0);
  apply_grasps(control, belief);
  begin_pushes(control, dt, belief);
  const std::vector<Mover> movers = movers_of(belief, X_WG, dt, tools.robot_bounds);
  const auto has_physics = static_cast<bool>(tools.simulators);

  Worlds worlds = worlds_of(belief, islands);
  std::vector<Falling> falling;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    ObjectBelief& object = belief.objects[i];
    const bool tracked = object.state == belief::TrackState::kTracked;
    const std::optional<int> hand = holder_of(*belief.scene, static_cast<int>(i));
    const std::optional<double> released = release_time(control, *belief.scene, object.name, dt);
    core::RandomStream draws = tools.stream.at(belief.step, static_cast<std::uint32_t>(i));
    std::vector<bool> smooth(object.particles.size(), false);
    const bool seen = tracked || object.state == belief::TrackState::kDoubtful;
    if (i >= keeps_modes.size() || !keeps_modes[i])
      change_modes(options, seen, tracked, hand.has_value(), has_physics, dt, draws, smooth, object);
    WorldsOfIsland* const island = worlds.of(i);
    if (island != nullptr) island->begin(i, released.has_value(), object);
    const Vector3d centre = centre_of(*belief.scene, object);
    // Physics says whether what rests is touched. Of what is seen some particles stay: the frame tells, too.
    const bool may_be_pushed = has_physics && is_present(object) && !movers.empty();
    const double radius = may_be_pushed ? radius_of(*belief.scene, object) : 0.0;
    for (std::size_t k = 0; k < object.particles.size(); ++k) {
      Particle& particle = object.particles[k];
      double left = dt;
      const double own_draw = draws.uniform();
      const double physics_draw = island != nullptr ? island->shared_draw(k, own_draw) : own_draw;
      const double smooth_draw = draws.uniform();
      double physics_share = tracked ? options.physics_share : kUnseenPhysicsShare;
      if (particle.mode == MotionMode::kHeld && hand) {
        const Pose& X_from = belief.robot[static_cast<std::size_t>(*hand)];
        const Pose& X_to = X_WG[static_cast<std::size_t>(*hand)];
        const double held = released.value_or(dt);
        if (held > 0.0) carry(particle, X_from, geometry::interpolate(X_from, X_to, held / dt), held);
        // What is held slips when the hand moves.
        const bool still = tracked && !released && stands_still(X_from, X_to);
        add_noise(still ? kStillNoise : options.held, dt, particle.covariance);
        if (!released) continue;
        wake(options, particle);
        left = dt - held;
        physics_share = kPhysicsAfterRelease;
      } else if (particle.mode == MotionMode::kHeld) {
        wake(options, particle);  // nobody holds it
      }
      if (particle.mode == MotionMode::kResting) {
        add_noise(tracked ? kStillNoise : options.resting, dt, particle.covariance);
        if (may_be_pushed && physics_draw < physics_share && may_touch(movers, particle.X_WO * centre, radius))
          falling.push_back({i, k, dt, particle.X_WO, particle.V_WO, /*woken=*/true, /*keeps_pose=*/tracked});
      } else if (left > 0.0) {
        // What is seen and may be still goes nowhere in one step that its velocity does not say.
        const bool idle = tracked && !released && may_be_still(particle);
        const Particle before = particle;
        const bool goes_on = tracked && !released && is_slow(particle) && (smooth[k] || smooth_draw < kSmoothShare);
        drift(particle, centre, left, tracked ? options.velocity_keep : options.unseen_velocity_keep,
              goes_on ? scaled(options.moving, kSmoothNoise) : options.moving);
        if (has_physics && !idle && is_present(object) && physics_draw < physics_share) {
          falling.push_back({i, k, left, particle.X_WO, particle.V_WO});
          particle.X_WO = before.X_WO;  // physics moves the mean; the spread grows alike
          particle.V_WO = before.V_WO;
          if (object.state == belief::TrackState::kUnseen && !released) {
            Particle stays = before;
            clear_twist(stays);
            add_noise(options.resting, left, stays.covariance);
            falling.back().covariance_at_rest = stays.covariance;
          }
        } else if (island != nullptr && !idle && is_present(object)) {
          island->may_fall.push_back({i, k, left, particle.X_WO, particle.V_WO});
        }
      }
      limit_spread(particle.covariance);
    }
    if (released) set_holder(i, std::nullopt, belief);
  }
  for (WorldsOfIsland& island : worlds.islands) {
    combine_weights(island.members, island.log_weights, belief);
    island.fall_together(belief, falling);
  }
  PredictReport report = move_on(belief, std::move(falling), worlds, X_WG, dt, options, tools);
  end_pushes(dt, belief);
  belief.robot.assign(X_WG.begin(), X_WG.end());
  return report;
}

}  // namespace prescene::filter
