// SPDX-License-Identifier: Apache-2.0
// Trials of a planned action as simulated instances.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "planned_action.h"
#include "prescene/belief/prediction.h"
#include "prescene/core/clock.h"
#include "prescene/queries/parameter_search.h"
#include "prescene/queries/query_engine.h"
#include "prescene/simulation/simulator.h"
#include "wanted_outcome.h"

namespace prescene::queries {

class ActionTrials final : public TrialRunner {
 public:
  /// What is given must outlive it. `scene` has what is asked for; `net_seed` as SearchOptions.
  ActionTrials(const Prior& prior, PlannedAction& plan, const WantedOutcome& wanted,
               std::shared_ptr<const belief::Scene> scene, const simulation::Simulator& simulator,
               const belief::AchieveQuery& query, const QueryContext& context, double duration, std::uint64_t net_seed);

  bool possible(std::span<const double> point) override { return !plan_.obstacle(values_at(point)); }
  bool run(std::span<const Trial> trials, std::span<TrialEnd> ends) override;
  bool enough() const override;
  /// The whole runs of some trials; shorter where it is stopped. They are not counted.
  std::vector<belief::Trajectory> runs_of(std::span<const Trial> trials);

  std::vector<double> values_at(std::span<const double> point) const;
  /// Instances, seconds and what went wrong in them, of all trials so far.
  const belief::Basis& basis() const { return basis_; }
  bool cancelled() const { return cancelled_; }

 private:
  bool simulate(std::span<const Trial> trials, std::vector<belief::Trajectory>& runs);
  void draw(const Trial& trial, belief::WorldState& start, std::vector<belief::Action>& actions) const;

  const Prior& prior_;
  PlannedAction& plan_;
  const WantedOutcome& wanted_;
  std::shared_ptr<const belief::Scene> scene_;
  const simulation::Simulator& simulator_;
  const belief::AchieveQuery& query_;
  const QueryContext& context_;
  simulation::RunRequest request_;
  int start_dimensions_ = 0, first_coordinate_ = 0;
  core::SobolNet net_;
  core::RandomStream fresh_;
  core::Stopwatch watch_;
  belief::Basis basis_;
  double overlapping_ = 0.0;
  bool cancelled_ = false;
};

}  // namespace prescene::queries
