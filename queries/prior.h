// SPDX-License-Identifier: Apache-2.0
// What a query starts from, whether it is a belief or a scene's priors: a scene with exactly the objects that take
// part, and the distribution of its start.
#pragma once

#include <memory>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/query.h"
#include "prescene/filter/operators/track_state.h"
#include "prescene/simulation/outcomes/start_distribution.h"

namespace prescene::queries {

/// How far a hand backs off when nothing says how, m and s.
inline constexpr double kRetreat = 0.1, kRetreatDuration = 0.3;

struct Prior {
  std::shared_ptr<const belief::Scene> scene;
  simulation::StartDistribution starts;
  belief::WorldState likeliest;
  core::RandomStream stream;
  belief::Pose X_WC;
  bool seen = false;                  ///< From a belief: the scene's own actions are past.
  std::vector<std::string> left_out;  ///< Names of the scene's outcomes and groups that can't be judged.
  std::vector<double> existence;      ///< By object: the probability that it is there, [0, 1].
  /// By object: what frames showed of its colours; null = nothing.
  std::vector<std::shared_ptr<const std::vector<belief::ColorShare>>> colors;
};

/// Whether the object takes part in what is foreseen.
using filter::is_present;

/// Objects as the belief has them, those that lie still flush with what is below (Seating); robot bodies stand where
/// they stood at the belief's step, times count from there.
Prior prior_of(const belief::Belief& belief);
Prior prior_of(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed);

/// That the prior has no object of this name: the nearest names, or all.
core::Status no_such_object(const Prior& prior, const std::string& name);

/// The prior's scene with other actions and outcomes; fails with the reason when a name or value in them is wrong.
core::Result<std::shared_ptr<const belief::Scene>> with_question(const belief::Scene& scene,
                                                                 std::vector<belief::Action> actions,
                                                                 std::vector<belief::Outcome> outcomes,
                                                                 std::vector<belief::ExclusiveOutcomes> exclusive);

}  // namespace prescene::queries
