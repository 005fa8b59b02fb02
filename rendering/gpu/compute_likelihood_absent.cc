// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/gpu/compute_likelihood.h"

namespace prescene::rendering {

bool compute_compiled_in() { return false; }

core::Result<std::unique_ptr<ComputeLikelihoodBatch>> make_compute_likelihood_batch(
    std::unique_ptr<LikelihoodBatch> /*processor*/, const ComputeOptions& /*options*/) {
  return core::unavailable(
      "likelihood in compute shaders: this build left OpenGL out: configure with -DPRESCENE_EGL=ON (needs libegl-dev "
      "and libopengl-dev), or use the processor");
}

}  // namespace prescene::rendering
