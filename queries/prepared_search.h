// SPDX-License-Identifier: Apache-2.0
// All that trials of a question take: names resolved, the action planned, the simulator made.
#pragma once

#include <memory>

#include "action_trials.h"

namespace prescene::queries {

struct PreparedSearch {
  WantedOutcome wanted;
  std::unique_ptr<PlannedAction> plan;
  std::shared_ptr<const belief::Scene> scene;
  std::unique_ptr<simulation::Simulator> simulator;
  SearchOptions options;
  std::unique_ptr<ActionTrials> trials;
};

/// `prior`, `query` and `context` must outlive it. Fails where a name, a range or the outcome is wrong.
core::Result<std::unique_ptr<PreparedSearch>> prepare_search(const Prior& prior, const belief::AchieveQuery& query,
                                                             const QueryContext& context);

}  // namespace prescene::queries
