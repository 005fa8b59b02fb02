// SPDX-License-Identifier: Apache-2.0
// How densely a frame is sampled for the likelihood.
#pragma once

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/proposals/frame.h"

namespace prescene::filter {

/// With a target_width at which the smallest followed thing in sight covers options.enough_pixels of the reduced image:
/// that of options.terms where that is enough (and where the camera is not valid), else about twice that, four times,
/// ..., but at most 320, every fourth pixel of the camera, and 10,000 reduced pixels on all things together. What a
/// thing covers is the mean of its box over all turns (Cauchy: a quarter of its surface), so that it does not change
/// while it turns in place.
///
/// The frame is not taken to tell more for that, as noise may be correlated over larger areas than tempering says: with
/// A + s0^2 - s^2 in place of A (correlated_px2), n pixels at a spacing s are worth as much as n s^2 / s0^2 at s0.
FrameSampling sampled_for(const belief::Belief& belief, const belief::Observation& observation,
                          const FrameOptions& options, MeshCache& meshes);

}  // namespace prescene::filter
