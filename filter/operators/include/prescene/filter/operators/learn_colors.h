// SPDX-License-Identifier: Apache-2.0
// Learns what objects look like from the frames in which they are surely seen.
//
//   learn_colors(frame, observation, reports, options, tools, belief);      // after weighing, before resampling
#pragma once

#include <span>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/proposals/frame.h"

namespace prescene::filter {

/// Whether a frame shows the object so surely that its colours may be learned from it: tracked, not transparent, and
/// all that ColorLearningOptions asks for. `report` is of the object's particles as they are.
bool surely_seen(const belief::ObjectBelief& object, const belief::ObjectModel& model, const WeightReport& report,
                 const ColorLearningOptions& options);

/// Blends the frame's colours into those objects of the belief that it surely shows. The object's pixels are those that
/// its heaviest particle shows, measured where it says, with the same around them; the rest are those that show
/// something else, with the same around them. Nothing without a colour image, and nothing of an object whose pixels
/// the colours learned so far speak against.
void learn_colors(const FilterFrame& frame, const belief::Observation& observation,
                  std::span<const WeightReport> reports, const ColorLearningOptions& options, const FilterTools& tools,
                  belief::Belief& belief);

}  // namespace prescene::filter
