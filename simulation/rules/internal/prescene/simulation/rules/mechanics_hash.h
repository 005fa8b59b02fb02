// SPDX-License-Identifier: Apache-2.0
// Hashes of all that a simulator's steps depend on besides the instance's own state: what snapshots are checked with.
#pragma once

#include <cstdint>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/random.h"
#include "prescene/simulation/rules/mechanics_options.h"

namespace prescene::simulation {

/// Of shapes, inertia, contact properties, gravity, fixed poses, timelines, names, and the options. Not of where
/// objects start or what they weigh (states contain that), nor of what is seen or asked.
std::uint64_t mechanics_hash(const belief::Scene& scene, const MechanicsOptions& options);
/// Of the actions with what is drawn in them.
std::uint64_t mechanics_hash(const std::vector<belief::Action>& actions, const core::RandomStream& stream);

}  // namespace prescene::simulation
