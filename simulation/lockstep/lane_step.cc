// SPDX-License-Identifier: Apache-2.0
// The stages of a step: free flight, contacts of what may touch, impulses. What splits it is in lane_impacts.cc, what
// leaves objects out of it in lane_sleep.cc.
#include <algorithm>
#include <cmath>

#include "lane_engine.h"
#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {

void LaneEngine::guide(std::span<const std::uint8_t> wanted) {
  const auto dt = static_cast<Real>(scene_->options.step);
  for (int object = 0; object < objects(); ++object) {
    for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot) {
      const int at = state_.at(object, slot);
      const Moved& moved = moved_[static_cast<std::size_t>(at)];
      if (moved.motion == LaneMotion::kFree) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        state_.flown_p[i][at] = moved.next_p[i];
        state_.flown_v[i][at] = state_.v[i][at];
        state_.flown_w[i][at] = state_.w[i][at];
      }
      for (std::size_t i = 0; i < 4; ++i) state_.flown_q[i][at] = moved.next_q[i];
      const Vector3d com = vector_at(state_.com, at);
      const double radius = scene_->lanes.bodies[static_cast<std::size_t>(object)].radius + com.norm();
      state_.travel[at] =
          dt * static_cast<Real>(vector_at(state_.v, at).norm() + vector_at(state_.w, at).norm() * radius);
    }
  }
}

/// Lists the slots in which an object and another body may touch. Returns whether there are any.
bool LaneEngine::list_pair(int object, int body, std::span<const std::uint8_t> wanted) {
  const bool with_object = body >= 0 && body < objects();
  listed_.assign(wanted.begin(), wanted.end());
  std::uint8_t any = 0;
  for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot) {
    const LaneMotion a = motion(slot, object);
    bool meets = a == LaneMotion::kFree;
    if (with_object) {
      const LaneMotion b = motion(slot, body);
      meets = (meets || b == LaneMotion::kFree) && a != LaneMotion::kFrozen && b != LaneMotion::kFrozen;
    } else if (body >= 0) {
      meets = meets && present_[kinematic_of(body, slot)] != 0;
    }
    std::uint8_t& listed = listed_[static_cast<std::size_t>(slot)];
    listed = listed != 0 && meets ? 1 : 0;
    any |= listed;
  }
  return any != 0;
}

void LaneEngine::touch_objects(int object, std::span<const std::uint8_t> wanted) {
  const LockstepScene& lanes = scene_->lanes;
  const auto& parts = lanes.bodies[static_cast<std::size_t>(object)].parts;
  for (int other = object + 1; other < objects(); ++other) {
    if (!list_pair(object, other, wanted)) continue;
    const auto first = static_cast<std::size_t>(lanes.first_part[static_cast<std::size_t>(other)]);
    const std::size_t last = first + lanes.bodies[static_cast<std::size_t>(other)].parts.size();
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t j = first; j < last; ++j) pairs_.shapes[j].clear();
      find_body_pairs(lanes, {object, static_cast<int>(i), listed_}, other, state_, pairs_);
      for (std::size_t j = first; j < last; ++j) {
        touch_part(parts[i], j);
      }
    }
  }
}

/// The pairs of a part with another one.
void LaneEngine::touch_part(const ConvexPart& part, std::size_t other) {
  if (pairs_.shapes[other].empty()) return;
  const LockstepScene& lanes = scene_->lanes;
  const bool spheres = part.spheres || lanes.part_of(lanes.parts[other]).spheres;
  if (spheres) {
    touch_spheres(lanes, part, static_cast<int>(other), pairs_.shapes[other], state_, spheres_);
  } else {
    touch_shape(lanes, part, static_cast<int>(other), pairs_.shapes[other], state_);
  }
}

void LaneEngine::touch_surroundings(int object, std::span<const std::uint8_t> wanted) {
  const LockstepScene& lanes = scene_->lanes;
  const auto& parts = lanes.bodies[static_cast<std::size_t>(object)].parts;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!list_pair(object, -1, wanted)) return;
    pairs_.planes.clear();
    pairs_.boxes.clear();
    for (auto& list : pairs_.shapes) list.clear();
    find_pairs(lanes, {object, static_cast<int>(i), listed_}, state_, pairs_);
    for (int body = objects(); body < static_cast<int>(lanes.bodies.size()); ++body) {
      if (!list_pair(object, body, wanted)) continue;
      find_body_pairs(lanes, {object, static_cast<int>(i), listed_}, body, state_, pairs_);
    }
    if (parts[i].spheres) {
      // Of a face or about an edge: the spheres see which.
      for (const LanePairs::Plane& plane : pairs_.planes)
        pairs_.boxes.push_back({plane.object, lanes.planes[static_cast<std::size_t>(plane.plane)].part});
      for (const LanePairs::Near& box : pairs_.boxes)
        touch_spheres(lanes, parts[i], box.other, std::span(&box, 1), state_, spheres_);
    } else {
      touch_planes(lanes, parts[i], pairs_.planes, state_);
      touch_boxes(lanes, parts[i], pairs_.boxes, state_);
    }
    for (std::size_t j = 0; j < pairs_.shapes.size(); ++j) touch_part(parts[i], j);
  }
}

/// What came free inside of what held it does not touch that until they have parted.
void LaneEngine::part(int object, std::span<const std::uint8_t> wanted) {
  const LockstepScene& lanes = scene_->lanes;
  for (int slot = 0; slot < static_cast<int>(wanted.size()); ++slot) {
    const std::size_t place = place_of(object, slot);
    std::uint64_t& parting = moved_[place].parting;
    if (!wanted[static_cast<std::size_t>(slot)] || parting == 0) continue;
    LaneContact* contacts = state_.contacts(state_.at(object, slot));
    int& count = state_.contact_count[place];
    for (int body = objects(); body < static_cast<int>(lanes.bodies.size()); ++body) {
      const std::uint64_t bit = std::uint64_t{1} << body;
      if (!(parting & bit)) continue;
      const auto with_body = [&](const LaneContact& c) {
        return lanes.parts[static_cast<std::size_t>(c.part)].body == body;
      };
      const bool overlap =
          std::any_of(contacts, contacts + count, [&](const LaneContact& c) { return with_body(c) && c.gap <= 0; });
      if (overlap) {
        count = static_cast<int>(std::remove_if(contacts, contacts + count, with_body) - contacts);
      } else {
        parting &= ~bit;
      }
    }
  }
}

void LaneEngine::fly_all(std::span<const std::uint8_t> wanted) {
  for (int object = 0; object < objects(); ++object) fly(scene_->lanes, object, wanted, state_);
  guide(wanted);
}

void LaneEngine::touch_all(std::span<const std::uint8_t> wanted) {
  for (int object = 0; object < objects(); ++object) {
    touch_objects(object, wanted);
    touch_surroundings(object, wanted);
    if (scene_->lanes.has_kinematic()) part(object, wanted);
  }
}

void LaneEngine::find_contacts(std::span<const std::uint8_t> wanted) {
  for (int object = 0; object < objects(); ++object) {
    std::fill_n(state_.contact_count.begin() + state_.at(object, 0), wanted.size(), 0);
    std::fill_n(state_.dropped_count.begin() + state_.at(object, 0), wanted.size(), 0);
  }
  fly_and_touch(wanted);
}

void LaneEngine::end_part(std::span<const std::uint8_t> wanted) {
  const auto count = static_cast<int>(wanted.size());
  touching_.clear();
  flying_.clear();
  totals_.assign(wanted.size(), 0);
  // By the number of contacts, most first, so that slots that share a vector have about as many.
  std::fill(starts_.begin(), starts_.end(), 0);
  const int most = state_.room() * objects();
  std::size_t touching = 0;
  for (int slot = 0; slot < count; ++slot) {
    if (!wanted[static_cast<std::size_t>(slot)]) continue;
    int& total = totals_[static_cast<std::size_t>(slot)];
    for (int object = 0; object < objects(); ++object) total += state_.contact_count[place_of(object, slot)];
    if (total == 0) {
      for (int object = 0; object < objects(); ++object) {
        state_.warm_count[place_of(object, slot)] = 0;
        flying_.push_back(state_.at(object, slot));
      }
    } else {
      ++starts_[static_cast<std::size_t>(most - total) + 1];
      ++touching;
    }
  }
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  touching_.resize(touching);
  for (int slot = 0; slot < count; ++slot) {
    const int total = totals_[static_cast<std::size_t>(slot)];
    if (total == 0) continue;
    touching_[static_cast<std::size_t>(starts_[static_cast<std::size_t>(most - total)]++)] = slot;
  }
  solve(scene_->lanes, touching_, state_, scratch_);
  land(flying_, state_);
  keep_places(wanted);
}

bool LaneEngine::diverged(int slot) const {
  for (int object = 0; object < objects(); ++object) {
    const int at = state_.at(object, slot);
    const Real q = state_.q[0][at] + state_.q[1][at] + state_.q[2][at] + state_.q[3][at];
    const bool sound = std::isfinite(state_.distance2[at]) && std::isfinite(q) &&
                       static_cast<double>(state_.speed2[at]) < kLargestSpeed * kLargestSpeed;
    if (!sound) return true;
  }
  return false;
}

}  // namespace prescene::simulation
