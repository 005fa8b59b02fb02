// SPDX-License-Identifier: Apache-2.0
// Episodes in which one unreported thing happens, drawn at random: what explanations are tested on.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "prescene/belief/event.h"
#include "prescene/service/recording/played_scene.h"

namespace prescene::service {

struct EventEpisode {
  std::string kind;   ///< One of event_episode_kinds().
  std::string world;  ///< Scene file (YAML) of what happens.
  std::string known;  ///< The one that the tracker is given.
  std::vector<UnannouncedChange> changes;
  bool reports_robot = true;
  double from = 0.0, to = 0.0;  ///< s; the window to be explained.
  belief::EventKind truth = belief::EventKind::kNothing;
  std::string object;      ///< That it happens to; "" for nothing.
  double time = 0.0;       ///< s since the first frame.
  double direction = 0.0;  ///< rad from W's x, of pushes and blows.
};

/// nothing, pushed, pushed_over, pushed_off, bumped, bumped_over, slipped, moved, taken_away, put_in, exchanged.
const std::vector<std::string>& event_episode_kinds();
/// Things, places, parameters and the event's time are drawn with `seed`. `kind`: one of event_episode_kinds()
/// (checked).
EventEpisode make_event_episode(const std::string& kind, std::uint64_t seed);

}  // namespace prescene::service
