// SPDX-License-Identifier: Apache-2.0
// How far an answer can be trusted: chaos, the model's step and priors, and the spread of ways.
#pragma once

#include <optional>
#include <vector>

#include "foresee.h"
#include "prescene/belief/prediction.h"

namespace prescene::queries {

/// Runs some instances again from starts near by. Empty when stopped, or with fewer than 32 instances.
std::vector<belief::ChaosCheck> check_for_chaos(const Foresight& foresight, const Prior& prior, double confidence,
                                                const QueryContext& context);

/// Runs the first instances again at half and double step, and with each uncertain physical parameter of an object or
/// support at the ends of its prior. Nothing when stopped.
core::Result<std::optional<belief::ModelError>> model_error(const Foresight& foresight, const Prior& prior,
                                                            double confidence, const QueryContext& context);

/// Up to `count` instances' ways of the objects (by index). Not `complete` when stopped, or where the points of all of
/// them would not fit into an answer.
std::vector<belief::ObjectPath> paths_of(const Foresight& foresight, const Prior& prior, int count,
                                         const std::vector<std::size_t>& objects, const QueryContext& context,
                                         bool& complete);

}  // namespace prescene::queries
