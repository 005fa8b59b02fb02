// SPDX-License-Identifier: Apache-2.0
// Chooses who scores poses: the processor, or a graphics card if there is one. Both give the same bits.
//
//   PRESCENE_TRY(auto batch, make_likelihood_batch({}));
#pragma once

#include <memory>

#include "prescene/core/status.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

enum class Weigher {
  kAutomatic,  ///< A graphics card if one is found and passes the test of its arithmetic, else the processor.
  kProcessor,  ///< Always; LikelihoodChoice::device is ignored.
  kGraphics,   ///< OpenGL wherever it runs, also in Mesa's software renderer. An error if it runs nowhere.
};

struct LikelihoodChoice {
  Weigher weigher = Weigher::kAutomatic;
  int device = -1;  ///< Of graphics_devices(); -1 = the first that will do.
};

/// The likelihood of rendering/simd (the processor), or that of rendering/gpu, which leaves to the former what the
/// device cannot do. Fails with kInvalidInput for a device that is not listed. With kGraphics it also fails with
/// kUnavailable and kUnsupported as make_compute_likelihood_batch does; kAutomatic takes the processor instead.
core::Result<std::unique_ptr<LikelihoodBatch>> make_likelihood_batch(const LikelihoodChoice& choice);

}  // namespace prescene::rendering
