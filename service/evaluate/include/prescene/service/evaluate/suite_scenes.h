// SPDX-License-Identifier: Apache-2.0
// Scenes of everyday situations that a tracker has to cope with, drawn at random: what a simulated robot and its
// surroundings do, and what of it is reported to the tracker.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "prescene/service/recording/played_scene.h"

namespace prescene::service {

/// One sequence.
struct SuiteScene {
  std::string world;  ///< Scene file (YAML) of what happens.
  std::string known;  ///< The scene file that the tracker is given: without what it does not know of.
  std::vector<UnannouncedChange> changes;
  bool reports_robot = true;
};

/// in_hand, behind_box, drawer, tipped, twins, taken_away, put_in, clutter, unknown_hand, thin, bottle.
const std::vector<std::string>& suite_kinds();
/// Sizes, places and motions are drawn with `seed`. `kind`: one of suite_kinds() (checked).
SuiteScene make_suite_scene(const std::string& kind, std::uint64_t seed);

}  // namespace prescene::service
