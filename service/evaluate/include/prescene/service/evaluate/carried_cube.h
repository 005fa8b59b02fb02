// SPDX-License-Identifier: Apache-2.0
// The carried_cube folder: real frames of a cube in a robot's hand, of which no model is given, with true poses.
#pragma once

#include <filesystem>

#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/service/backends.h"
#include "prescene/service/evaluate/tracking_suite.h"

namespace prescene::service {

inline constexpr const char* kCarriedCube = "carried_cube";

/// Whether the folder is there and its true poses can be read.
core::Status check_carried_cube(const std::filesystem::path& folder);

/// Tracks the recording from a first pose that is about 1 cm and 5 degrees off, drawn with `seed`. The cube collides as
/// the hull of cube_caps.ply, is seen as cube.ply, and looks the same in its 24 rotations. Errors name the file.
core::Result<TrackingFigures> track_carried_cube(const std::filesystem::path& folder, std::uint64_t seed,
                                                 Backends& backends, const core::Cancellation& cancellation);

}  // namespace prescene::service
