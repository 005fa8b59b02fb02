// SPDX-License-Identifier: Apache-2.0
// Who scores poses here: the processor, or a graphics card where there is one. Both give the same bits.
//
//   PRESCENE_TRY(auto batch, make_likelihood_batch({}));
#pragma once

#include <memory>

#include "prescene/core/status.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

enum class Weigher {
  kAutomatic,  ///< A graphics card where one is found and computes rightly, else the processor.
  kProcessor,
  kGraphics,  ///< OpenGL wherever it runs, Mesa's software renderer too; none is an error.
};

struct LikelihoodChoice {
  Weigher weigher = Weigher::kAutomatic;
  int device = -1;  ///< Of graphics_devices(); -1 = the first that will do.
};

/// rendering/simd, or rendering/gpu before it. kAutomatic never fails but for a device that is not listed.
core::Result<std::unique_ptr<LikelihoodBatch>> make_likelihood_batch(const LikelihoodChoice& choice);

}  // namespace prescene::rendering
