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
  // Joints are aimed at the end of a whole step, and hands do what the whole step takes.
  if (!scene_->joints.empty() || any_loaded_) return 0;
  int moving = 0;
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const Moving& m = moving_[i];
    if (i < objects_.size() && objects_[i].held) return 0;
    if (m.present && !m.dynamic && m.travel > 0.0) return 0;
    moving += m.present && m.dynamic ? 1 : 0;
  }
  return most_splits(moving);
}

/// How many of the parts that are left come before the next impact.
int InstanceWorld::parts_to_impact(int left) const {
  double first = std::numeric_limits<double>::infinity();
  for (const SolverContact& c : contacts_) {
    const Approach approach{c.gap, c.speed_before, free_acceleration(c), compiled(c.body_a).radius};
    first = std::min(first, split_time(approach, scene_->options));
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
    place_dynamic();
    if (!find_contacts(cancellation)) return false;
  }
  give_back_pressed();
  return true;
}

}  // namespace prescene::simulation
