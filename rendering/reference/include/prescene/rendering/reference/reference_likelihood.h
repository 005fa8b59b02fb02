// SPDX-License-Identifier: Apache-2.0
// The readable likelihood backend: one hypothesis after the other on a scalar rasteriser, within its bounding box.
// And, for people who ask why a pose is believed, what each pixel says.
//
//   const geometry::Image<float> nats = log_ratio_map(terms, hypothesis);
//   if (nats(x, y) < 0.0F) ...   // this pixel speaks against the pose; NaN where the object is not seen
#pragma once

#include <memory>

#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

/// Deterministic bits: only additions, multiplications, divisions, square roots and our own exp and log.
std::unique_ptr<LikelihoodBatch> make_reference_likelihood_batch();

/// What each pixel of the frame's camera says about a hypothesis, nats: they add up to PoseEvidence::log_ratio. NaN
/// where the object is not seen, be it hidden by a known surface.
geometry::Image<float> log_ratio_map(const FrameTerms& frame, const PoseHypothesis& hypothesis);

}  // namespace prescene::rendering
