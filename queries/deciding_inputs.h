// SPDX-License-Identifier: Apache-2.0
// Which uncertain inputs decide an outcome.
#pragma once

#include <string>
#include <vector>

#include "foresee.h"
#include "prescene/belief/prediction.h"

namespace prescene::queries {

/// What of the start and the actions was drawn: its name and its value in each instance. What does not vary is left
/// out.
struct UncertainInput {
  std::string name;
  std::vector<double> values;
};
std::vector<UncertainInput> uncertain_inputs(const Foresight& foresight, const Prior& prior,
                                             const QueryContext& context);

/// Of each variable whose classes vary; empty with fewer than 128 instances, from the first 65536 where there are more.
/// Those worked out so far when abandoned.
std::vector<belief::DecidingInputs> deciding_inputs(const Foresight& foresight, const Prior& prior,
                                                    const QueryContext& context);

}  // namespace prescene::queries
