// SPDX-License-Identifier: Apache-2.0
// The likelihood in vector instructions: vertices, triangles and pixels in lanes, one pass from a pose to its log
// ratio, no image on the way. Pixels are the reference backend's, bit by bit, and so are their ratios; only sums are
// rounded otherwise (by less than 1e-4 of max(1, |log ratio|)). The same bits on all instruction sets of a processor
// and for any number of threads.
//
//   const auto batch = make_simd_likelihood_batch();
//   const auto workspace = batch->make_workspace();             // one per thread, kept
//   batch->evaluate(terms, hypotheses, *workspace, evidences);  // terms: see likelihood_batch.h
#pragma once

#include <memory>

#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

/// Images of less than 16 columns go through the reference backend.
std::unique_ptr<LikelihoodBatch> make_simd_likelihood_batch();

}  // namespace prescene::rendering
