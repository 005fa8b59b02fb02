// SPDX-License-Identifier: Apache-2.0
// How large a scene's things are, and how large its world therefore is.
#pragma once

#include "prescene/belief/scene.h"

namespace prescene::belief {

/// m: the cube root of the volume of its box in its own axes.
double object_size(const ObjectModel& model);
/// m: that of the smallest object. Objects with no extent count as absent; kHouseholdSize if there are none.
double smallest_size(const Scene& scene);
inline constexpr double kHouseholdSize = 0.1;

/// Steps and tolerances fit the smallest object; nothing was tested beside one larger by more than this factor.
inline constexpr double kGreatestSizeRatio = 1000.0;

/// m from W's origin: farther away things have left the world, and simulators freeze them. kWorldRadius for things up
/// to kLargestInWorld; where the smallest object is larger, as many times larger.
double world_radius(const Scene& scene);
inline constexpr double kLargestInWorld = 0.3;  ///< m

}  // namespace prescene::belief
