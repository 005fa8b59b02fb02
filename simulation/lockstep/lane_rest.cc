// SPDX-License-Identifier: Apache-2.0
#include "lane_rest.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/simulation/rules/rest.h"

namespace prescene::simulation {

LaneFooting footing_of(LaneEngine& engine, int slot, int object) {
  LaneFooting footing;
  const Vector3d& gravity = engine.scene().scene.gravity_W;
  if (gravity.isZero(0.0)) {
    footing.firm = true;
    return footing;
  }
  const Vector3d down = gravity.normalized();
  const Vector3d u = down.unitOrthogonal();
  const Vector3d v = down.cross(u);
  std::array<geometry::Vector2d, kMaxContacts> points;
  std::size_t count = 0;
  bool others = false;
  const Vector3d center = engine.center_of_mass(slot, object);
  // Contacts are kept with the first of two objects.
  for (int first = 0; first <= object; ++first) {
    const geometry::Matrix3d R = engine.rotation(slot, first).toRotationMatrix();
    const Vector3d from_center = engine.center_of_mass(slot, first) - center;
    for (const LaneContact& c : engine.contacts(slot, first)) {
      const int other = engine.scene().lanes.parts[static_cast<std::size_t>(c.part)].body;
      if (first != object && other != object) continue;
      if (static_cast<double>(c.gap) > engine.scene().options.touching_distance) continue;
      const Vector3d r =
          from_center + R * Vector3d(static_cast<double>(c.position[0]), static_cast<double>(c.position[1]),
                                     static_cast<double>(c.position[2]));
      footing.height = std::max(footing.height, down.dot(r));
      const int bearer = first != object ? first : other;
      others = others || (bearer >= 0 && bearer < engine.objects() && engine.motion(slot, bearer) != LaneMotion::kHeld);
      if (!others) points[count++] = {u.dot(r), v.dot(r)};
    }
  }
  std::array<geometry::Vector2d, 2 * kMaxContacts> corners;
  footing.firm = !others && stands_firmly(std::span(points).first(count), footing.height, corners);
  return footing;
}

bool lies_still(LaneEngine& engine, int slot, int object) {
  if (engine.velocity(slot, object).norm() > kCreepSpeed) return false;
  // What is near another object would be woken in the next step.
  for (int first = 0; first <= object; ++first) {
    for (const LaneContact& c : engine.contacts(slot, first)) {
      const int other = engine.scene().lanes.parts[static_cast<std::size_t>(c.part)].body;
      if (first == object ? other >= 0 && other < engine.objects() : other == object) return false;
    }
  }
  return footing_of(engine, slot, object).firm;
}

bool NudgeTest::slides(LaneEngine& engine, int slot) const {
  for (int object = 0; object < engine.objects(); ++object)
    if (engine.free(slot, object) && engine.velocity(slot, object).norm() > kCreepSpeed &&
        footing_of(engine, slot, object).firm)
      return true;
  return false;
}

bool NudgeTest::stands_or_begins(LaneEngine& engine, int slot) {
  for (int object = 0; object < engine.objects(); ++object) {
    before_[static_cast<std::size_t>(object)] = {engine.center_of_mass(slot, object), engine.rotation(slot, object),
                                                 footing_of(engine, slot, object)};
  }
  object_ = -1;
  if (!next_object(engine, slot)) return true;
  engine.save(slot, saved_);
  down_ = engine.scene().scene.gravity_W.normalized();
  axis_ = 0;
  nudge(engine, slot);
  return false;
}

bool NudgeTest::next_object(const LaneEngine& engine, int slot) {
  for (++object_; object_ < engine.objects(); ++object_) {
    if (engine.free(slot, object_) && !before_[static_cast<std::size_t>(object_)].footing.firm) return true;
  }
  return false;
}

void NudgeTest::nudge(LaneEngine& engine, int slot) {
  engine.nudge(slot, object_, nudge_axis(down_, axis_), kNudge);
  const double height = before_[static_cast<std::size_t>(object_)].footing.height;
  const double time = nudge_window(height, engine.scene().scene.gravity_W.norm());
  left_ = static_cast<int>(std::ceil(time / engine.scene().options.step));
}

bool NudgeTest::runs_away(const LaneEngine& engine, int slot, int object) const {
  const Before& before = before_[static_cast<std::size_t>(object)];
  const double drop = down_.dot(engine.center_of_mass(slot, object) - before.center);
  return may_topple(drop, before.footing.height) &&
         topples(drop, before.footing.height,
                 geometry::log_rotation(engine.rotation(slot, object) * before.rotation.conjugate()), down_);
}

NudgeTest::Verdict NudgeTest::after_step(LaneEngine& engine, int slot) {
  for (int object = 0; object < engine.objects(); ++object) {
    if (!engine.free(slot, object) || !runs_away(engine, slot, object)) continue;
    engine.restore(slot, saved_);
    return Verdict::kRunsAway;
  }
  if (--left_ > 0) return Verdict::kGoesOn;
  engine.restore(slot, saved_);
  if (++axis_ == kNudgeAxes) {
    if (!next_object(engine, slot)) return Verdict::kReturns;
    axis_ = 0;
  }
  nudge(engine, slot);
  return Verdict::kGoesOn;
}

}  // namespace prescene::simulation
