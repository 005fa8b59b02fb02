// SPDX-License-Identifier: Apache-2.0
// Which instance stands for an outcome, and what happened in a run, in words.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/trajectory.h"

namespace prescene::queries {

/// Index of the pose with the smallest weighted sum of distances to all others (the medoid): distance is that of
/// positions with a turn of one radian counting as much as `radius` metres. Nothing for no poses. Ties go to the first;
/// of more than 512 poses every second, third, ... is looked at.
std::optional<std::size_t> medoid(std::span<const belief::Pose> poses, double radius);

/// What an object did from the first to the last state of a run: "stays", "slides", "turns", "tips over", "rolls",
/// "falls", with where it came to lie if it fell or tipped ("falls and comes to rest on floor"). Moves below `max_move`
/// (m) and turns below `max_turn` (rad) count as staying.
std::string event_text(const belief::Scene& scene, const belief::Trajectory& run, int object, double max_move,
                       double max_turn);

/// Radius of a ball about the origin of an object's frame that holds all of it, m.
double radius_of(const belief::ObjectModel& model);

}  // namespace prescene::queries
