// SPDX-License-Identifier: Apache-2.0
// A release that nobody reported: what is seen to have left the hand that is said to hold it is not held any more.
//
//   int released = infer_releases({}, belief);   // once a frame, after weight
#pragma once

#include "prescene/belief/belief.h"
#include "prescene/filter/operators/predict.h"

namespace prescene::filter {

/// Follows where each held object is in its hand, and lets go of those that left it: the belief's scene (a copy of it)
/// says then that nothing holds them, and they begin to move as predict() has what is let go of. Returns how many.
int infer_releases(const PredictOptions& options, belief::Belief& belief);

}  // namespace prescene::filter
