// SPDX-License-Identifier: Apache-2.0
// Objects that are at rest while others still move: nothing of them is computed until another one comes near. A step of
// a thing of spheres that stands about costs as much as one of a thing that falls.
#include <algorithm>

#include "lane_engine.h"

namespace prescene::simulation {

void LaneEngine::fall_asleep(int slot, int object) {
  const std::size_t place = place_of(object, slot);
  LaneContact* const kept = footings_.data() + place * kMostFooting;
  int count = 0;
  for (const LaneContact& c : found(slot, object)) {
    const bool touches = c.impulse > 0 || static_cast<double>(c.gap) <= scene_->options.touching_distance;
    if (!touches) continue;
    if (count == kMostFooting) return;
    kept[count++] = c;
  }
  footing_counts_[place] = count;
  const int at = state_.at(object, slot);
  for (std::size_t i = 0; i < 3; ++i) state_.v[i][at] = state_.w[i][at] = Real(0);
  set_motion(slot, object, LaneMotion::kAsleep);
}

void LaneEngine::copy_footing(std::size_t from, std::size_t to) {
  footing_counts_[to] = footing_counts_[from];
  std::copy_n(footings_.data() + from * kMostFooting, footing_counts_[from], footings_.data() + to * kMostFooting);
}

void LaneEngine::save_footing(std::size_t place, ObjectSlot& out) const {
  out.footing_count = 0;
  if (out.motion != LaneMotion::kAsleep) return;
  out.footing_count = footing_counts_[place];
  std::copy_n(footings_.data() + place * kMostFooting, out.footing_count, out.footing);
}

void LaneEngine::restore_footing(std::size_t place, const ObjectSlot& in) {
  if (in.motion != LaneMotion::kAsleep) return;
  footing_counts_[place] = in.footing_count;
  std::copy_n(in.footing, in.footing_count, footings_.data() + place * kMostFooting);
}

void LaneEngine::forget_contacts(int slot) {
  for (int object = 0; object < objects(); ++object) state_.contact_count[place_of(object, slot)] = 0;
}

/// Wakes what something may touch in this step. Returns whether it did, and marks the slots in woken_: their contacts
/// are to be found anew.
bool LaneEngine::wake(std::span<const std::uint8_t> wanted) {
  if (objects() == 1) return false;
  woken_.assign(wanted.size(), 0);
  bool any = false;
  for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot) {
    if (!wanted[static_cast<std::size_t>(slot)]) continue;
    bool woken = false;
    for (int object = 0; object < objects(); ++object) {
      for (const LaneContact& c : found(slot, object)) {
        const int other = scene_->lanes.parts[static_cast<std::size_t>(c.part)].body;
        if (other < 0 || other >= objects()) continue;
        for (const int one : {object, other}) {
          if (motion(slot, one) != LaneMotion::kAsleep) continue;
          set_motion(slot, one, LaneMotion::kFree);
          woken = true;
        }
      }
    }
    if (!woken) continue;
    woken_[static_cast<std::size_t>(slot)] = 1;
    any = true;
    forget_contacts(slot);
    for (int object = 0; object < objects(); ++object) state_.dropped_count[place_of(object, slot)] = 0;
  }
  return any;
}

/// The solver turns what it does not move by a rounding error.
void LaneEngine::keep_places(std::span<const std::uint8_t> wanted) {
  for (int object = 0; object < objects() && objects() > 1; ++object)
    for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot)
      if (wanted[static_cast<std::size_t>(slot)] && motion(slot, object) == LaneMotion::kAsleep) arrive(slot, object);
}

void LaneEngine::fly_and_touch(std::span<const std::uint8_t> wanted) {
  fly_all(wanted);
  touch_all(wanted);
  while (wake(wanted)) {
    fly_all(woken_);
    touch_all(woken_);
  }
}

}  // namespace prescene::simulation
