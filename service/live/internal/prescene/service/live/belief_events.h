// SPDX-License-Identifier: Apache-2.0
// What changed from one published belief to the next, for users that act on changes and not on every step: states,
// motion, hands, supports, silent cameras and clocks that were set back.
//
//   BeliefEvents events;
//   for (const BeliefEvent& event : events.note(summary, *belief->scene, news)) ... to_json(event)
#pragma once

#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "prescene/service/belief_summary.h"
#include "prescene/service/tracking/tracker.h"

namespace prescene::service {

/// One change; the words of `event` are those of docs/reference/ros2.md.
struct BeliefEvent {
  core::TimeNs stamp_ns = 0;  ///< Of the frame that showed it.
  std::uint64_t step = 0;
  std::string event;
  std::string object = {};  ///< "" where it is of no object; the same of the two below.
  std::string support = {};
  std::optional<std::string> camera = {};  ///< The name of a scene's only camera may be "".
  std::optional<std::string> from = {}, to = {};
  std::string reason = {};  ///< "" = none is known.
};
/// {"stamp_ns", "step", "event", "object" or "support" or "camera" (a key of these, or none), "from", "to", "reason"}:
/// null where there is none.
nlohmann::ordered_json to_json(const BeliefEvent& event);

/// Not thread-safe.
class BeliefEvents {
 public:
  /// What a step changed, in an order that does not depend on anything else. The first belief of a session, and the
  /// first after the belief began anew, changes everything.
  std::vector<BeliefEvent> note(const BeliefSummary& summary, const belief::Scene& scene, const StepNews& news);
  /// Of the frames of all cameras: whether they come. The first of them are no event. `why_not` is called
  /// where an event needs it only.
  std::optional<BeliefEvent> note_frames(bool come, core::TimeNs stamp_ns, const std::function<std::string()>& why_not);

 private:
  struct Known {
    belief::TrackState state;
    std::optional<std::string> held_by;
    belief::MotionMode motion;        // as it was published last, ...
    belief::MotionMode other_motion;  // ... and what it was in the last steps
    int other_steps = 0;
  };
  std::uint64_t step_ = 0;
  std::map<std::string, Known> objects_;
  std::set<std::string> supports_;
  std::set<std::string> silent_;
  std::optional<bool> frames_come_;
};

}  // namespace prescene::service
