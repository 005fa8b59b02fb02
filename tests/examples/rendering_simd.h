// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of rendering/simd take for granted.
#pragma once

#include <span>
#include <vector>

#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering::given_rendering_simd {

extern const FrameTerms terms;
extern const std::vector<PoseHypothesis> hypotheses;
extern const std::span<PoseEvidence> evidences;

}  // namespace prescene::rendering::given_rendering_simd
