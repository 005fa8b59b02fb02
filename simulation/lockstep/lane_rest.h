// SPDX-License-Identifier: Apache-2.0
// Whether calm objects merely balance: the tests of simulation/rules/rest.h, which take several steps here, one with
// each of the other slots'.
#pragma once

#include "lane_engine.h"

namespace prescene::simulation {

/// What an object stands on. After LaneEngine::find_contacts, by which the slot has not moved.
struct LaneFooting {
  bool firm =
      false;  ///< On what is fixed or held, the vertical through the centre of mass well inside of the contacts.
  double height = 0.0;  ///< Of the centre of mass above the lowest contact.
};
LaneFooting footing_of(LaneEngine& engine, int slot, int object);
/// Whether a free object that has been calm for long enough is at rest whatever the others do: it stands firmly on
/// fixed bodies and does not slide. After LaneEngine::advance.
bool lies_still(LaneEngine& engine, int slot, int object);

/// Turns the objects of a slot that do not stand firmly, one after the other, a little about four horizontal axes, and
/// watches each time whether something turns on.
class NudgeTest {
 public:
  explicit NudgeTest(int objects) : before_(static_cast<std::size_t>(objects)) {}

  /// Whether one that stands firmly still slides, slowly. After LaneEngine::find_contacts.
  bool slides(LaneEngine& engine, int slot) const;
  /// Whether all stand firmly, so that there is nothing to nudge. Else keeps the slot as it is and gives it the first
  /// nudge. After LaneEngine::find_contacts.
  bool stands_or_begins(LaneEngine& engine, int slot);
  enum class Verdict { kGoesOn, kReturns, kRunsAway };
  /// After each step of the slot. With a verdict the slot is again as it was.
  Verdict after_step(LaneEngine& engine, int slot);
  /// Puts the slot back as it was before the first nudge.
  void cancel(LaneEngine& engine, int slot) { engine.restore(slot, saved_); }

 private:
  struct Before {
    Vector3d center;
    geometry::Quaterniond rotation;
    LaneFooting footing;
  };

  /// The next object that does not stand firmly; false if there is none.
  bool next_object(const LaneEngine& engine, int slot);
  void nudge(LaneEngine& engine, int slot);
  bool runs_away(const LaneEngine& engine, int slot, int object) const;

  SlotState saved_;
  Vector3d down_;
  std::vector<Before> before_;  // by object
  int object_ = 0;              // that is being nudged
  int axis_ = 0;
  int left_ = 0;  // steps
};

}  // namespace prescene::simulation
