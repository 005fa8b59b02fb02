// SPDX-License-Identifier: Apache-2.0
// Instances of an estimate once more: where they started, and what becomes of them from other starts or with another
// simulator. What is random in an instance's actions stays as it was.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::simulation {

/// Where the first `count` instances of an estimate made with these arguments started.
std::vector<belief::WorldState> starts_of(const StartDistribution& starts, const OutcomeEstimate& estimate,
                                          std::size_t count, const core::RandomStream& stream, core::ThreadPool& pool);

/// The same with every uncertain coordinate moved by `displacement` standard deviations times a standard normal number
/// (a coordinate of another distribution: by as much of its own probability).
std::vector<belief::WorldState> starts_nearby(const StartDistribution& starts, const OutcomeEstimate& estimate,
                                              std::size_t count, double displacement, const core::RandomStream& stream,
                                              core::ThreadPool& pool);

/// Other starts than those of an estimate, drawn independently: starts number `first` and on of a sequence that is the
/// same for the same stream.
std::vector<belief::WorldState> fresh_starts(const StartDistribution& starts, std::uint32_t first, std::size_t count,
                                             const core::RandomStream& stream, core::ThreadPool& pool);

/// Per instance (numbered from `first`) the class of every variable, -1 where the simulation failed; nothing when
/// cancelled. `certifier` may be null.
std::optional<std::vector<std::vector<int>>> classes_from(
    const Simulator& simulator, std::span<const belief::WorldState> starts, std::span<const Variable> variables,
    const RunRequest& request, const core::RandomStream& stream, const Certifier* certifier, core::ThreadPool& pool,
    const core::Cancellation* cancellation = nullptr, std::uint32_t first = 0);

}  // namespace prescene::simulation
