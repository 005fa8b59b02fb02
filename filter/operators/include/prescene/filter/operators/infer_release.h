// SPDX-License-Identifier: Apache-2.0
// A release that nobody reported: what is seen to have left the hand that is said to hold it is not held any more.
//
//   int released = infer_releases(belief, options);   // once a frame, after weight
#pragma once

#include "prescene/belief/belief.h"

namespace prescene::filter {

struct InferReleaseOptions {
  /// m. An object has left its place in the hand when it is further from it, or turned ... Range 0 to 0.2. Chosen.
  double least_shift = 0.03;
  /// rad. ... further, each at least three of its standard deviations, ... Range 0 to 3.2. Chosen.
  double least_turn = 0.5;
  /// frames. ... in so many tracked ones in a row. Range 1 to 30. Chosen.
  int apart_frames = 3;
};

/// Follows where each held object is in its hand, and lets go of those that left it: the belief's scene (a copy of it)
/// says then that nothing holds them. Returns how many.
int infer_releases(belief::Belief& belief, const InferReleaseOptions& options);

}  // namespace prescene::filter
