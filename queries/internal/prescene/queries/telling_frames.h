// SPDX-License-Identifier: Apache-2.0
// Which frames of a window are weighed, as all would take too long.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "prescene/queries/explain.h"

namespace prescene::queries {

/// The frames of each camera that differ most: places in `frames` at which equal parts of all change have passed,
/// filled up evenly where little changes; the camera's last always, and its first, which tells what is there when the
/// window begins. Several cameras have equal numbers of them, as far as each has so many. Ascending.
std::vector<std::size_t> telling_frames(std::span<const WindowFrame> frames, int count);

/// The last frame of each camera, the latest first.
std::vector<std::size_t> last_of_cameras(std::span<const WindowFrame> frames);

}  // namespace prescene::queries
