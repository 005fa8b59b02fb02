// SPDX-License-Identifier: Apache-2.0
// The readable likelihood backend: one hypothesis after the other on a scalar rasteriser, within its bounding box.
#pragma once

#include <memory>

#include "prescene/rendering/likelihood_batch.h"

namespace prescene::rendering {

/// Deterministic bits: only additions, multiplications, divisions, square roots and our own exp and log.
std::unique_ptr<LikelihoodBatch> make_reference_likelihood_batch();

}  // namespace prescene::rendering
