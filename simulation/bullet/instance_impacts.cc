// SPDX-License-Identifier: Apache-2.0
// InstanceWorld: steps that are split at impacts (prescene/simulation/rules/impact_split.h).
#include <algorithm>
#include <limits>
#include <tuple>

#include "instance_world.h"
#include "prescene/simulation/rules/impact_split.h"

namespace prescene::simulation {

void InstanceWorld::set_part(int parts) { part_ = dt() * (static_cast<double>(parts) / kStepParts); }

int InstanceWorld::splits_allowed() const {
  // Joints are aimed at the end of a whole step, and forces of hands do what the whole step takes.
  if (!scene_->joints.empty() || any_loaded_) return 0;
  int moving = 0;
  for (const Moving& m : moving_) moving += m.present && m.dynamic ? 1 : 0;
  return most_splits(moving);
}

/// How long until the contact has gone on along a rim that one of the two leans on.
double InstanceWorld::rim_time(const SolverContact& c) const {
  double first = std::numeric_limits<double>::infinity();
  const double touching = scene_->options.touching_distance;
  if (c.gap > touching) return first;
  const Vector3d spin =
      moving_[static_cast<std::size_t>(c.body_a)].spin_before - moving_[static_cast<std::size_t>(c.body_b)].spin_before;
  for (const double side : {1.0, -1.0}) {
    const int body = side > 0.0 ? c.body_a : c.body_b;
    if (body >= scene_->object_count) continue;
    const Vector3d normal = side * c.normal;
    const Vector3d own = c.position + 0.5 * c.gap * normal;
    for (const Part& part : compiled(body).parts) {
      if (!part.core || !part.core->rims()) continue;
      const Frame X_WS = moving_[static_cast<std::size_t>(body)].X_WO * part.X_OS;
      const Vector3d& rims = *part.core->rims();
      const RimPair pair{X_WS.p, rims.x(), rims.y(), rims.z(), part.core->radius()};
      first = std::min(first, roll_time({X_WS.R.col(2), normal, side * spin}, pair, own, touching));
    }
  }
  return first;
}

/// How many of the parts that are left come before the next impact, or before a rim has rolled on.
int InstanceWorld::parts_to_impact(int left) const {
  double first = std::numeric_limits<double>::infinity();
  for (const SolverContact& c : contacts_) {
    const Approach approach{c.gap, c.speed_before, free_acceleration(c), compiled(c.body_a).radius};
    first = std::min(first, split_time(approach, scene_->options));
    first = std::min(first, rim_time(c));
  }
  return parts_until(first, dt(), left);
}

/// The contacts stay: they were found for more than what is taken now.
void InstanceWorld::shorten(int parts) {
  const double before = part_;
  set_part(parts);
  place_dynamic();
  const double ratio = part_ / before;
  for (SolverContact& c : contacts_) {
    // Gaps have half of what turning adds in the time for which they were found.
    c.gap -= 0.5 * before * c.turning * (1.0 - ratio * ratio);
    c.speed_before -= c.turning * (1.0 - ratio);
    c.turning *= ratio;
  }
}

/// What hands move, `parts` of the step on.
void InstanceWorld::lead_kinematic(int parts) {
  const double time = dt() * (static_cast<double>(parts) / kStepParts);
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    Moving& m = moving_[i];
    if (!m.present || m.dynamic || m.travel == 0.0) continue;
    m.X_WO.p += time * m.velocity;
    m.X_WO.R = geometry::exp_rotation(time * m.spin).toRotationMatrix() * m.X_WO.R;
    m.p_WCm = m.X_WO.p;
    sweep(static_cast<int>(i));
  }
}

void InstanceWorld::keep_pressed() {
  for (const SolverContact& c : contacts_)
    if (c.impulse > 0.0) pressed_.push_back(c);
}

/// Among the contacts of the last part, so that those of a pair lie together and pairs ascend.
void InstanceWorld::give_back_pressed() {
  const auto pair_before = [](const SolverContact& a, const SolverContact& b) {
    return std::tie(a.body_a, a.body_b) < std::tie(b.body_a, b.body_b);
  };
  // The last first, each before those of its pair: so the order is that of time.
  for (auto c = pressed_.rbegin(); c != pressed_.rend(); ++c)
    contacts_.insert(std::lower_bound(contacts_.begin(), contacts_.end(), *c, pair_before), *c);
}

/// From the contacts of a whole step to its end.
bool InstanceWorld::take_parts(const core::Cancellation* cancellation) {
  pressed_.clear();
  const int most = contacts_.empty() ? 0 : splits_allowed();
  int left = kStepParts;
  for (int splits = 0;; ++splits) {
    const int taken = splits < most ? parts_to_impact(left) : left;
    if (taken < left) shorten(taken);
    if (!solve(cancellation)) return false;
    integrate();
    left -= taken;
    if (left == 0) break;
    keep_pressed();
    set_part(left);
    lead_kinematic(taken);
    place_dynamic();
    if (!find_contacts(cancellation)) return false;
  }
  give_back_pressed();
  return true;
}

}  // namespace prescene::simulation
