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

/// Runs the first 256 instances again at half and double step, and with each uncertain physical parameter of an object
/// or support at the ends of its prior. Then other starts, each once as it is and once in each of these variants with
/// the same random numbers, until every shift of 3 points would be found with a probability of 0.9, or is clear: at
/// most 12,288, and 131,072 of all variants together. When stopped, those that are complete; nothing if there are none.
core::Result<std::optional<belief::ModelError>> model_error(const Foresight& foresight, const Prior& prior,
                                                            double confidence, const QueryContext& context);

/// How much wider the interval of a shift has to be to hold for all shifts of a kind at once [Bonferroni].
double widening(const belief::ModelError& error, belief::ModelError::Kind kind, double confidence);
/// The shift that would stand out from such an interval with a probability of 0.9.
double findable(const belief::ModelError::Shift& shift, double wider, double confidence);

/// Up to `count` instances' ways of the objects (by index). Not `complete` when stopped, or where the points of all of
/// them would not fit into an answer.
std::vector<belief::ObjectPath> paths_of(const Foresight& foresight, const Prior& prior, int count,
                                         const std::vector<std::size_t>& objects, const QueryContext& context,
                                         bool& complete);

}  // namespace prescene::queries
