// SPDX-License-Identifier: Apache-2.0
// What truly happened in a simulated recording, as its simulator knows it: which events, when, what moved, and where
// things ended. What is explained or predicted from the recording is judged by it.
//
//   PRESCENE_TRY(const HappenedRecord happened, happened_from_json(text));   // of kHappenedTopic
//   for (const HappenedEvent& event : happened.events) ... event.time, event.event, event.object
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/clock.h"
#include "prescene/core/status.h"
#include "prescene/service/recording/played_scene.h"

namespace prescene::service {

/// Times are s since the first frame.
struct HappenedEvent {
  double time = 0.0;
  /// The name of its belief::EventKind; empty: it is announced, touches nothing, or is of none of these kinds.
  std::string event;
  std::string object;     ///< That it happens to; empty: none.
  std::string action;     ///< kind_of() the scene's action that it is; empty: no action.
  bool reported = false;  ///< The robot announced it.
  friend bool operator==(const HappenedEvent&, const HappenedEvent&) = default;
};

struct ObjectCourse {
  std::string name;
  /// When it was first away from its start, and when it came to where it ends, by kMovedBy or kTurnedBy; both empty: it
  /// did not move.
  std::optional<double> moved_from, moved_until;
  std::optional<geometry::Pose> X_WO;  ///< In the end; empty: it is not there.
  friend bool operator==(const ObjectCourse&, const ObjectCourse&) = default;
};
/// Things settle by less when a scene begins.
inline constexpr double kMovedBy = 0.002;   // m
inline constexpr double kTurnedBy = 0.035;  // rad

struct JointEnd {
  std::string name;
  double position = 0.0;  ///< rad or m
  friend bool operator==(const JointEnd&, const JointEnd&) = default;
};

/// JSON form on kHappenedTopic.
struct HappenedRecord {
  core::TimeNs first_ns = 0;          ///< Stamp of the first frame.
  std::string stepper;                ///< "lockstep" or "bullet": whose truth it is, and ...
  double step = 0.0;                  ///< ... at which step, s.
  double resolution = 0.0;            ///< s: the interval at which motion was looked at.
  std::vector<HappenedEvent> events;  ///< Ascending in time.
  std::vector<ObjectCourse> objects;  ///< In the scene's order.
  std::vector<JointEnd> joints;
  friend bool operator==(const HappenedRecord&, const HappenedRecord&) = default;
};

/// Of a played scene: events, courses and joints. `parts` are of play_scene(scene, changes, ...), sampled as finely as
/// times are wanted; `reported`: the robot announces its actions. The actions themselves; pushes from their first touch
/// on; an object that comes out of a grip although no action lets go of it has slipped; and the changes, those of an
/// object at one frame as one event.
HappenedRecord happened_in(const belief::Scene& scene, std::span<const UnannouncedChange> changes,
                           std::span<const PlayedPart> parts, bool reported);

nlohmann::ordered_json to_json(const HappenedRecord& record);
/// kDataLoss where it is none.
core::Result<HappenedRecord> happened_from_json(const std::string& text);
/// A line for each event, "0.80 s: mug bumped, unreported", under a heading; empty where nothing happened.
std::string happened_text(const HappenedRecord& record);

}  // namespace prescene::service
