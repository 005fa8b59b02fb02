// SPDX-License-Identifier: Apache-2.0
// A picture of which choices of two parameters of an action bring an outcome about.
#pragma once

#include "prescene/belief/achieve.h"
#include "prescene/geometry/image.h"

namespace prescene::interfaces {

/// The answer's map with its axes and scale, a cross at the best choice and a frame about the most robust ones. Empty
/// where the answer has no map.
geometry::ColorImage action_map_picture(const belief::AchieveAnswer& answer);

}  // namespace prescene::interfaces
