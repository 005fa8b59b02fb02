// SPDX-License-Identifier: Apache-2.0
// InstanceWorld: free flight, and skipping the search for contacts while nothing can meet anything.
#include <algorithm>
#include <cmath>

#include "body_motion.h"
#include "instance_world.h"
#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {
namespace {

// Looking ahead costs about as much as a step: shorter flights are not worth it.
constexpr int kShortest = 4;
constexpr int kLongest = 128;
// Bounds are computed in other ways than steps are: room for rounding, m and as a share of speeds.
constexpr double kRounding = 1e-6;
constexpr double kDrift = 1.001;
// rad/s and m/s: whatever moves faster is left to step(), which knows what has diverged.
constexpr double kFastest = 1e3;

}  // namespace

InstanceWorld::Flight InstanceWorld::flight_of(const Object& object, const CompiledBody& body) const {
  // Without contact a step ends here.
  Flight flight;
  const Vector3d v_WCm = begun(object);
  flight.v_WCm = v_WCm + part_ * pull_on(object);
  flight.p_WCm = object.p_WCm + 0.5 * part_ * (v_WCm + flight.v_WCm);
  const Vector3d w_WO = object.loaded ? Vector3d(object.w_WO + part_ * object.spin_up) : object.w_WO;
  const Spin spin = spun(object.R_WO, w_WO, body, part_);
  flight.R_WO = spin.R_WO;
  flight.w_WO = spin.w_WO;
  return flight;
}

bool InstanceWorld::list_flyers() {
  flyers_.clear();
  for (int i = 0; i < scene_->object_count; ++i) {
    const Object& object = objects_[static_cast<std::size_t>(i)];
    if (object.frozen) continue;
    if (object.held || object.lag > 0.0) return false;
    const CompiledBody& body = scene_->bodies[static_cast<std::size_t>(i)];
    Flyer flyer;
    flyer.object = i;
    const Bounds box = parts_box(i, Frame(object_pose(object)));
    flyer.low = box.low - object.p_WCm;
    flyer.high = box.high - object.p_WCm;
    flyer.radius = body.radius + object.physical.center_of_mass.norm();
    // The angular momentum stays, so the spin is at most what it is about the axis of the least moment.
    const double momentum = (world_inertia(object.R_WO, body, 1.0) * object.w_WO).norm();
    flyer.spin = kDrift * std::max(object.w_WO.norm(), momentum / body.unit_moments.minCoeff());
    if (!(flyer.spin < kFastest && object.v_WCm.norm() < kFastest)) return false;
    flyers_.push_back(flyer);
  }
  return !flyers_.empty();
}

bool InstanceWorld::clear_for(int steps, double world_radius) {
  const Vector3d& gravity = scene_->scene.gravity_W;
  const double time = steps * dt();
  for (Flyer& flyer : flyers_) {
    const Object& object = objects_[static_cast<std::size_t>(flyer.object)];
    const Vector3d v_end = object.v_WCm + time * gravity;
    const Vector3d p_end = object.p_WCm + 0.5 * time * (object.v_WCm + v_end);
    Vector3d low = object.p_WCm.cwiseMin(p_end);
    Vector3d high = object.p_WCm.cwiseMax(p_end);
    for (int k = 0; k < 3; ++k) {
      if (object.v_WCm[k] * v_end[k] >= 0.0) continue;
      const double apex = object.p_WCm[k] - 0.5 * object.v_WCm[k] * object.v_WCm[k] / gravity[k];
      low[k] = std::min(low[k], apex);
      high[k] = std::max(high[k], apex);
    }
    // No point of it is farther from the centre of mass than its radius, nor has turned farther than the spin allows.
    const double turned_by = flyer.radius * flyer.spin * time;
    const double speed = std::max(object.v_WCm.norm(), v_end.norm()) + dt() * gravity.norm();
    const double travel = kDrift * dt() * (speed + flyer.spin * flyer.radius);
    const Vector3d room = Vector3d::Constant(travel + kContactMargin + kRounding);
    const Vector3d sphere = Vector3d::Constant(flyer.radius);
    flyer.bounds.low = low + (flyer.low.array() - turned_by).matrix().cwiseMax(-sphere) - room;
    flyer.bounds.high = high + (flyer.high.array() + turned_by).matrix().cwiseMin(sphere) + room;
    if (flyer.bounds.low.cwiseAbs().cwiseMax(flyer.bounds.high.cwiseAbs()).norm() > world_radius) return false;
    for (const Bounds& part : fixed_parts_)
      if (flyer.bounds.overlaps(part)) return false;
    for (std::size_t i = scene_->bodies.size() - static_cast<std::size_t>(scene_->robot_count); i < moving_.size(); ++i)
      if (moving_[i].present && flyer.bounds.overlaps({moving_[i].low, moving_[i].high})) return false;
  }
  for (std::size_t i = 0; i < flyers_.size(); ++i)
    for (std::size_t j = i + 1; j < flyers_.size(); ++j)
      if (flyers_[i].bounds.overlaps(flyers_[j].bounds)) return false;
  return true;
}

int InstanceWorld::fly(int most, double world_radius) {
  if (!scene_->joints.empty()) return 0;
  if (most < kShortest || !contacts_.empty() || any_loaded_ || !player_.over(time()) || !list_flyers()) return 0;
  if (scene_->robot_count > 0 || player_.pusher_count() > 0) place_kinematic();
  int steps = std::min(most, kLongest);
  while (steps >= kShortest && !clear_for(steps, world_radius)) steps /= 2;
  if (steps < kShortest) return 0;

  const double calm = scene_->options.rest.energy;
  int done = 0;
  for (bool any_calm = false; done < steps && !any_calm; ++done) {
    for (const Flyer& flyer : flyers_) {
      Object& object = objects_[static_cast<std::size_t>(flyer.object)];
      const Flight flight = flight_of(object, scene_->bodies[static_cast<std::size_t>(flyer.object)]);
      object.v_WCm = flight.v_WCm;
      object.w_WO = flight.w_WO;
      // As integrate() does, in which adding nothing makes a zero of -0.
      object.p_WCm = flight.p_WCm + Vector3d::Zero();
      object.R_WO = flight.R_WO;
      const bool slow = 0.5 * object.v_WCm.squaredNorm() < 1.01 * calm;
      object.calm_steps = slow && energy(flyer.object) < calm ? object.calm_steps + 1 : 0;
      any_calm = any_calm || object.calm_steps > 0;
    }
    ++steps_;
  }
  contacts_.clear();
  contact_keys_.clear();
  touches_.clear();
  warm_.clear();
  return done;
}

}  // namespace prescene::simulation
