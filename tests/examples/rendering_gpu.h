// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of rendering/gpu take for granted.
#pragma once

#include <iostream>
#include <memory>
#include <span>
#include <vector>

#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/simd/simd_likelihood.h"

namespace prescene::rendering::given_rendering_gpu {

extern const FrameTerms terms;
extern const std::unique_ptr<LikelihoodWorkspace> workspace;
extern const std::vector<PoseHypothesis> hypotheses;
extern const std::span<PoseEvidence> evidences;

}  // namespace prescene::rendering::given_rendering_gpu
