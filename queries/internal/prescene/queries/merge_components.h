// SPDX-License-Identifier: Apache-2.0
// Reduction of a mixture of Gaussians on poses [Runnalls 2007].
#pragma once

#include <vector>

#include "prescene/queries/final_poses.h"

namespace prescene::queries {

/// Fewer components of about the same density: greedily merges the pair of one group whose merging costs least. Mass,
/// mean and covariance of the whole are kept (to first order in rotation). Heaviest first.
std::vector<belief::PoseComponent> merged(std::vector<Kernel> kernels, const DensityOptions& options,
                                          core::ThreadPool& pool);

}  // namespace prescene::queries
