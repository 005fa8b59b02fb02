// SPDX-License-Identifier: Apache-2.0
// Steps that are split at impacts (prescene/simulation/rules/impact_split.h).
#include <algorithm>
#include <limits>

#include "lane_engine.h"
#include "prescene/simulation/rules/impact_split.h"

namespace prescene::simulation {
namespace {

Vector3d vector_of(const Real (&v)[3]) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

}  // namespace

/// Of a body at a point, W from the local origin.
Vector3d LaneEngine::velocity_at(int slot, int body, const Vector3d& point) const {
  const int at = state_.at(body, slot);
  return vector_at(state_.v, at) + vector_at(state_.w, at).cross(point - vector_at(state_.p, at));
}

/// How long until a contact has gone on along a rim that a body leans on. The body touches at `own` (W from the local
/// origin), `normal` points to it and `spin` is as the other body sees it.
double LaneEngine::rim_time(int slot, int body, const Vector3d& own, const Vector3d& normal,
                            const Vector3d& spin) const {
  double first = std::numeric_limits<double>::infinity();
  for (const ConvexPart& part : scene_->lanes.bodies[static_cast<std::size_t>(body)].parts) {
    if (part.kind != CoreKind::kCylinder) continue;
    const int at = state_.at(body, slot);
    const geometry::Matrix3d R = rotation(slot, body).toRotationMatrix();
    const Vector3d axis_P(part.R_PS[2], part.R_PS[5], part.R_PS[8]);
    const Vector3d middle_P = Vector3d(part.center.data()) - vector_at(state_.com, at);
    const RimPair rims{vector_at(state_.p, at) + R * middle_P, part.half[0], part.half[2], -part.half[2], part.radius};
    first = std::min(first, roll_time({R * axis_P, normal, spin}, rims, own, scene_->options.touching_distance));
  }
  return first;
}

/// How many of the parts that are left come before the next impact, or before a rim has rolled on.
int LaneEngine::parts_to_impact(int slot, int left) {
  const StepSettings& settings = scene_->lanes.settings;
  const Vector3d gravity(settings.gravity[0], settings.gravity[1], settings.gravity[2]);
  double first = std::numeric_limits<double>::infinity();
  for (int object = 0; object < objects(); ++object) {
    const int at = state_.at(object, slot);
    const auto contacts = found(slot, object);
    if (contacts.empty()) continue;
    const geometry::Matrix3d R = rotation(slot, object).toRotationMatrix();
    const Vector3d v = vector_at(state_.v, at), w = vector_at(state_.w, at);
    const bool falls = motion(slot, object) != LaneMotion::kHeld;
    const double reach = scene_->lanes.bodies[static_cast<std::size_t>(object)].radius;
    for (const LaneContact& c : contacts) {
      const Vector3d normal = R * vector_of(c.normal);
      const Vector3d arm = R * vector_of(c.position);
      double speed = normal.dot(v + w.cross(arm)) + static_cast<double>(c.turning);
      double acceleration = normal.dot(gravity);
      const int other = scene_->lanes.parts[static_cast<std::size_t>(c.part)].body;
      if (other >= 0) {
        // Bodies that hands move count as they move.
        speed -= normal.dot(velocity_at(slot, other, vector_at(state_.p, at) + arm));
        const bool other_falls = other < objects() && motion(slot, other) != LaneMotion::kHeld;
        acceleration = other_falls == falls ? 0.0 : other_falls ? -acceleration : acceleration;
      }
      const auto gap = static_cast<double>(c.gap);
      first = std::min(first, split_time({gap, speed, acceleration, reach}, scene_->options));
      if (gap > scene_->options.touching_distance) continue;
      const Vector3d spin = other < 0 ? w : Vector3d(w - vector_at(state_.w, state_.at(other, slot)));
      const Vector3d middle = vector_at(state_.p, at) + arm, aside = 0.5 * gap * normal;
      first = std::min(first, rim_time(slot, object, middle + aside, normal, spin));
      if (other >= 0 && other < objects())
        first = std::min(first, rim_time(slot, other, middle - aside, -normal, -spin));
    }
  }
  return parts_until(first, scene_->options.step, left);
}

void LaneEngine::set_share(int slot, int parts) {
  for (int object = 0; object < objects(); ++object)
    state_.share[state_.at(object, slot)] = static_cast<Real>(parts) / static_cast<Real>(kStepParts);
}

/// Contacts stay: they were found for the parts that were left, and now as many are taken as taken_ says.
void LaneEngine::shorten_contacts(int slot, int left) {
  const auto parts = static_cast<Real>(left) / static_cast<Real>(kStepParts);
  const Real before = static_cast<Real>(scene_->options.step) * parts;
  const Real ratio = static_cast<Real>(taken_[static_cast<std::size_t>(slot)]) / static_cast<Real>(left);
  for (int object = 0; object < objects(); ++object) {
    const int at = state_.at(object, slot);
    LaneContact* contacts = state_.contacts(at);
    for (int k = 0; k < state_.contact_count[static_cast<std::size_t>(at)]; ++k) {
      // Gaps have half of what turning adds in the time for which they were found.
      contacts[k].gap -= Real(0.5) * before * contacts[k].turning * (1 - ratio * ratio);
      contacts[k].turning *= ratio;
    }
  }
}

/// How far each slot goes: to the next impact, or on through it, or to the end of the step.
void LaneEngine::split(std::span<const std::uint8_t> wanted) {
  bool any = false;
  shortened_.assign(wanted.size(), 0);
  for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot) {
    const auto i = static_cast<std::size_t>(slot);
    taken_[i] = left_[i];
    if (!wanted[i]) continue;
    int total = 0;
    for (int object = 0; object < objects(); ++object) total += state_.contact_count[place_of(object, slot)];
    if (total == 0 || driven_[i]) continue;
    taken_[i] = parts_to_impact(slot, left_[i]);
    if (taken_[i] == left_[i]) continue;
    set_share(slot, taken_[i]);
    lead(slot, kStepParts - left_[i], kStepParts - left_[i] + taken_[i]);
    shorten_contacts(slot, left_[i]);
    shortened_[i] = 1;
    any = true;
  }
  if (any) fly_all(shortened_);
}

/// Contacts that pressed, before those of the next part take their place.
void LaneEngine::keep_pressed(int slot) {
  for (int object = 0; object < objects(); ++object) {
    const geometry::Matrix3d R = rotation(slot, object).toRotationMatrix();
    int& kept = kept_[place_of(object, slot)];
    for (const LaneContact& c : found(slot, object)) {
      if (c.impulse > 0 && kept++ < state_.room())
        pressed_.push_back({slot, object, c, R * vector_of(c.position), R * vector_of(c.normal)});
    }
  }
}

void LaneEngine::give_back_pressed() {
  for (Pressed& kept : pressed_) {
    const int at = state_.at(kept.object, kept.slot);
    int& count = state_.contact_count[static_cast<std::size_t>(at)];
    if (count == state_.room()) continue;
    const geometry::Matrix3d R = rotation(kept.slot, kept.object).toRotationMatrix();
    const Vector3d position = R.transpose() * kept.position_W, normal = R.transpose() * kept.normal_W;
    for (int k = 0; k < 3; ++k) {
      kept.contact.position[k] = static_cast<Real>(position[k]);
      kept.contact.normal[k] = static_cast<Real>(normal[k]);
    }
    state_.contacts(at)[count++] = kept.contact;
  }
  for (const Pressed& kept : pressed_) kept_[place_of(kept.object, kept.slot)] = 0;
  pressed_.clear();
}

void LaneEngine::advance(std::span<const std::uint8_t> wanted) {
  const auto count = static_cast<int>(wanted.size());
  going_.assign(wanted.begin(), wanted.end());
  left_.assign(wanted.size(), kStepParts);
  taken_.resize(wanted.size());
  const int most = most_splits(objects());
  for (int splits = 0;; ++splits) {
    if (splits < most) {
      split(going_);
    } else {
      taken_ = left_;
    }
    end_part(going_);
    bool any = false;
    for (int slot = 0; slot < count; ++slot) {
      const auto i = static_cast<std::size_t>(slot);
      if (!going_[i]) continue;
      left_[i] -= taken_[i];
      going_[i] = left_[i] > 0 ? 1 : 0;
      if (!going_[i]) {
        set_share(slot, kStepParts);
        continue;
      }
      any = true;
      keep_pressed(slot);
      set_share(slot, left_[i]);
      lead(slot, kStepParts - left_[i], kStepParts);
      forget_contacts(slot);
    }
    if (!any) break;
    fly_and_touch(going_);
  }
  give_back_pressed();
  for (int object = 0; object < objects(); ++object) measure(scene_->lanes, object, count, state_);
}

}  // namespace prescene::simulation
