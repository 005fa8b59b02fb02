// SPDX-License-Identifier: Apache-2.0
// Where an object may be that is not seen.
#pragma once

#include <vector>

#include "prescene/filter/operators/weight.h"

namespace prescene::filter {

/// How far from where it was: standard deviations, and by how much it may have fallen.
struct HiddenReach {
  double shift = 0.0;                ///< m, in each direction.
  double turn = 0.0;                 ///< rad, about each axis.
  Vector3d fall = Vector3d::Zero();  ///< In W; a place is up to so much further down.
};

/// Standard deviation, m, of where it may be after so many seconds out of sight, when it is thought to have moved.
double hidden_shift(double seconds);

/// Those of `draws` poses about X_WO that are hidden in the frame, outside of supports and not beyond one.
std::vector<Pose> hidden_places(const FilterFrame& frame, const rendering::FrameTerms& terms,
                                const SearchTarget& target, const Pose& X_WO, const HiddenReach& reach, int draws,
                                const WeightOptions& weighting, const FilterTools& tools, core::RandomStream stream);

}  // namespace prescene::filter
