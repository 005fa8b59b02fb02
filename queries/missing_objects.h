// SPDX-License-Identifier: Apache-2.0
// Things that the tracker has not found, looked for in the last frame of a window: what was put in may have come too
// late for it, or stand badly.
#pragma once

#include <optional>
#include <vector>

#include "prescene/filter/proposals/frame.h"
#include "prescene/queries/explain.h"

namespace prescene::queries {

/// Where each object of the belief after `last` is that it does not hold to be there; the others, and those that are
/// not found, are empty. By filter::find_in_frame(), whatever the scene says of their start. Errors of
/// filter::prepare_frame.
core::Result<std::vector<std::optional<belief::Pose>>> find_missing(const WindowFrame& last,
                                                                    const ExplainContext& context,
                                                                    const filter::FilterTools& tools,
                                                                    std::uint64_t seed);

}  // namespace prescene::queries
