// SPDX-License-Identifier: Apache-2.0
// InstanceWorld: saving, restoring and what the rest detector asks.
#include <algorithm>
#include <cmath>

#include "instance_world.h"

namespace prescene::simulation {

void InstanceWorld::save(ByteWriter& out) const {
  out.value(static_cast<std::uint32_t>(objects_.size()));
  out.value(start_time_);
  out.value(steps_);
  player_.save(out);
  for (const Object& object : objects_) {
    out.vector(object.p_WCm);
    out.rotation(object.R_WO);
    out.vector(object.v_WCm);
    out.vector(object.w_WO);
    out.value(object.physical.mass);
    out.vector(object.physical.center_of_mass);
    out.value(object.physical.friction);
    out.value(object.physical.impact_friction);
    out.value(object.physical.restitution);
    out.vector(object.v_middle);
    out.vector(object.w_middle);
    out.value(object.lag);
    out.value(object.owed);
    out.value(object.calm_steps);
    out.value(object.held);
    out.value(object.frozen);
  }
  for (const std::uint8_t parting : parting_) out.value(parting);
  out.value(static_cast<std::uint32_t>(warm_.size()));
  for (const Warm& warm : warm_) {
    out.value(warm.key);
    out.vector(warm.position);
    out.value(warm.impulse);
    out.vector(warm.friction_impulse);
  }
  for (const Hinged& joint : hinged_) {
    out.value(joint.drawn.friction);
    out.value(joint.drawn.damping);
    for (const double impulse : joint.impulse) out.value(impulse);
  }
  out.value(static_cast<std::uint32_t>(touches_.size()));
  for (const Touch& touch : touches_) {
    out.value(touch.first);
    out.value(touch.second);
    out.value(touch.impulse);
    out.value(touch.normal_z);
  }
}

bool InstanceWorld::restore(ByteReader& in) {
  if (in.value<std::uint32_t>() != objects_.size()) return false;
  start_time_ = in.value<double>();
  steps_ = in.value<std::int64_t>();
  player_.restore(in);
  for (Object& object : objects_) {
    object.p_WCm = in.vector();
    object.R_WO = in.rotation();
    object.v_WCm = in.vector();
    object.w_WO = in.vector();
    object.physical.mass = in.value<double>();
    object.physical.center_of_mass = in.vector();
    object.physical.friction = in.value<double>();
    object.physical.impact_friction = in.value<double>();
    object.physical.restitution = in.value<double>();
    object.v_middle = in.vector();
    object.w_middle = in.vector();
    object.lag = in.value<double>();
    object.owed = in.value<double>();
    object.calm_steps = in.value<int>();
    object.held = in.value<bool>();
    object.frozen = in.value<bool>();
    object.loaded = false;
  }
  any_loaded_ = false;
  for (std::uint8_t& parting : parting_) parting = in.value<std::uint8_t>();
  const auto count = in.value<std::uint32_t>();
  if (!in.ok() || count > in.left()) return false;
  warm_.resize(count);
  for (Warm& warm : warm_) {
    warm.key = in.value<std::uint64_t>();
    warm.position = in.vector();
    warm.impulse = in.value<double>();
    warm.friction_impulse = in.vector();
  }
  for (Hinged& joint : hinged_) {
    joint.drawn.friction = in.value<double>();
    joint.drawn.damping = in.value<double>();
    for (double& impulse : joint.impulse) impulse = in.value<double>();
  }
  const auto touch_count = in.value<std::uint32_t>();
  if (!in.ok() || touch_count > in.left()) return false;
  touches_.resize(touch_count);
  for (Touch& touch : touches_) {
    touch.first = in.value<int>();
    touch.second = in.value<int>();
    touch.impulse = in.value<double>();
    touch.normal_z = in.value<double>();
  }
  return in.ok() && in.at_end();
}

InstanceWorld::Footing InstanceWorld::footing(int object, const Vector3d& down) {
  place_kinematic();
  place_dynamic();
  find_contacts(nullptr);
  Footing footing;
  footprint_.clear();
  for (const SolverContact& c : contacts_) {
    if ((c.body_a != object && c.body_b != object) || c.gap > scene_->options.touching_distance) continue;
    const int other = c.body_a == object ? c.body_b : c.body_a;
    footing.others = footing.others || (other < scene_->object_count && free(other));
    footing.height = std::max(footing.height, down.dot(c.position - center_of_mass(object)));
    footprint_.push_back(c.position);
  }
  footing.points = footprint_;
  return footing;
}

void InstanceWorld::nudge(int index, const Vector3d& axis_W, double angle) {
  turn_tree(index, geometry::exp_rotation(angle * axis_W), center_of_mass(index));
}

}  // namespace prescene::simulation
