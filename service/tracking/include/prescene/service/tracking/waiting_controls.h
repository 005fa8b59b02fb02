// SPDX-License-Identifier: Apache-2.0
// What the robot said that it does, until a frame comes that it is done in: control messages in the time of the frames'
// stamps. The tracker and whoever reads a recording afterwards share its rules.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prescene/belief/action.h"
#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/clock.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::service {

/// What was sent or received so near to the newest frame's stamp was so by the clock of the frames. Otherwise that
/// clock is another one (a simulated time, a camera's own), or was set.
inline constexpr core::TimeNs kSameClockNs = 2'000'000'000;

/// What a control message says. Times of its actions count from `stamp_ns`, or from when it was sent.
struct ParsedControl {
  std::optional<core::TimeNs> stamp_ns;
  std::vector<std::pair<core::TimeNs, belief::Action>> actions;  ///< Each with when it starts, ns after that.
  bool restarts = false;                                         ///< The belief is to begin anew.
};
/// Of {"stamp_ns": n, "actions": [...]} or {"restart": true}; kInvalidInput naming the key that makes no sense.
core::Result<ParsedControl> parse_control(const std::string& json);

/// How long after its start an action lets go of its object, ns: a placement or insertion at its end, others have 0.
core::TimeNs placement_time(const belief::Action& action);

/// Actions that change nothing in what is tracked.
struct IdleControls {
  std::uint64_t count = 0;
  std::string last;  ///< "the action 'release' of 'cup' changes nothing: nothing holds it"; "" = there is none.
};
/// Those of a control that begins in `scene`, in their order: an object or a hand that is not in the scene, or
/// something to be done with an object (release, place, pour, transport, tilt, insert) that nothing holds then; and
/// forces (bump, pull, move_joint), of which the tracker follows what is seen.
IdleControls idle_controls(const belief::Scene& scene, const belief::Control& control);

/// Not thread-safe. Times are stamps of frames, ns.
class WaitingControls {
 public:
  /// Takes in a control message. `newest_frame_ns` is the stamp of the newest frame; empty = none has come yet, or the
  /// sender's clock went back.
  ///
  /// A control without a stamp counts from when it was sent; where the sender's clock is not that of the frames, from
  /// the newest frame; before there is one, from the first. kInvalidInput where it makes no sense or its stamp is more
  /// than a minute after the newest frame: by another clock, it would never be due. kResourceExhausted beyond 1000
  /// actions.
  ///
  /// The tracker follows a held object with its hand, so all that a `place` adds is when the object is let go of: it
  /// becomes a release at its end, unless the robot sends another action of that object before.
  core::Status take_in(const interfaces::ReceivedMessage& message, std::optional<core::TimeNs> newest_frame_ns);
  /// The clock of the frames is known: this is the first frame. Actions whose stamp is more than a minute after it are
  /// dropped.
  void begin_at(core::TimeNs first_frame_ns);
  /// The clock went back: what waits counts from the first frame of the new one, but for what has a stamp.
  void begin_again();

  /// Whether a control asked for the belief to begin anew, since this was asked last. What waited then was dropped with
  /// it.
  bool take_restart() { return std::exchange(restarts_, false); }

  /// All that is due at `end_ns`, in its order, with times in s from `begin_ns` on; what was due before has time 0.
  belief::Control due(core::TimeNs begin_ns, core::TimeNs end_ns) const;
  /// Forgets what due() said of this time.
  void forget_due(core::TimeNs end_ns);
  /// All that waits, with when it is due, in its order.
  std::vector<std::pair<core::TimeNs, belief::Action>> all() const;

  /// All that is kept, and the same from it; kInvalidInput naming the key that makes no sense.
  nlohmann::ordered_json to_json() const;
  static core::Result<WaitingControls> from_json(const nlohmann::ordered_json& json);

  std::size_t count() const { return waiting_.size(); }
  /// Since the start.
  std::uint64_t dropped() const { return dropped_; }

 private:
  struct Waiting {
    core::TimeNs due_ns = 0;
    core::TimeNs after_ns = 0;             // after the stamp or the sending
    std::optional<core::TimeNs> stamp_ns;  // as stated
    core::TimeNs sent_ns = 0;              // by the sender's clock
    belief::Action action;
    bool ends_place = false;  // a release that was not sent, but follows from a `place`
  };
  void sort();

  std::vector<Waiting> waiting_;  // ascending times
  std::uint64_t dropped_ = 0;
  bool restarts_ = false;
};

}  // namespace prescene::service
