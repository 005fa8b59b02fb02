// SPDX-License-Identifier: Apache-2.0
// Whether a calm object merely balances: the tests of Bullet's stepper (simulation/bullet/rest_detector.h), which take
// several steps here, one with each of the other slots'.
#pragma once

#include "lane_engine.h"

namespace prescene::simulation {

/// What an object stands on. After LaneEngine::find_contacts, by which the slot has not moved.
struct LaneFooting {
  bool firm = false;    ///< The vertical through the centre of mass passes well inside of the contacts.
  double height = 0.0;  ///< Of the centre of mass above the lowest contact.
};
LaneFooting footing_of(LaneEngine& engine, int slot);

/// Turns a slot a little about four horizontal axes, and watches each time whether it turns on.
class NudgeTest {
 public:
  /// Keeps the slot as it is, and gives it the first nudge.
  void begin(LaneEngine& engine, int slot, double height);
  enum class Verdict { kGoesOn, kReturns, kRunsAway };
  /// After each step of the slot. With a verdict the slot is again as it was.
  Verdict after_step(LaneEngine& engine, int slot);
  /// Puts the slot back as it was before begin().
  void cancel(LaneEngine& engine, int slot) { engine.restore(slot, saved_); }

 private:
  void nudge(LaneEngine& engine, int slot);

  SlotState saved_;
  Vector3d down_, center_;
  geometry::Quaterniond rotation_;
  double height_ = 0.0;
  int axis_ = 0;
  int left_ = 0;  // steps
};

}  // namespace prescene::simulation
