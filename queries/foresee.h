// SPDX-License-Identifier: Apache-2.0
// Simulates a scene from a prior under actions until the stop rule holds: what answers are made of.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/query.h"
#include "prescene/core/status.h"
#include "prescene/queries/query_engine.h"
#include "prescene/simulation/outcomes/certifier.h"
#include "prior.h"

namespace prescene::queries {

/// A scene under a request, with what it was asked, simulated until the stop rule holds.
struct Foresight {
  std::shared_ptr<const belief::Scene> scene;
  std::unique_ptr<simulation::Simulator> simulator;
  simulation::RunRequest request;
  std::vector<simulation::Variable> variables;
  std::unique_ptr<const simulation::Certifier> certifier;  ///< Null: every instance ran to rest.
  simulation::OutcomeEstimate estimate;
};
struct ForesightDetail {
  bool to_rest = true;  ///< Else instances end as soon as they are decided, where that can be proved.
  bool keep_contacts = false;
  /// Told of each look at what is known so far (simulation::EstimatorOptions::on_look); the foresight has all but its
  /// estimate then. May be empty.
  std::function<void(const Foresight& foresight, const simulation::OutcomeEstimate& so_far)> so_far = {};
};
/// s: between the states at which "ever" and "always" are judged; 0 where no outcome has either. 20 ms, less of small
/// things, and where what falls from a table would pass through a volume in less; at least a step.
double judging_interval(std::span<const belief::Outcome> outcomes, const simulation::Simulator& simulator);

/// Requested when the question is cancelled, and from QueryContext::simulate_until on.
core::Cancellation end_of_simulating(const QueryContext& context);

/// Certifies the outcomes of a foresight that has all but its estimate, were `duration` (s) of it simulated. Null:
/// nothing can be certified.
std::unique_ptr<const simulation::Certifier> certifier_of(const Foresight& foresight, double duration,
                                                          const QueryContext& context);

/// Fails when the duration is out of range, when the memory for a question does not hold it, when no simulator can be
/// made, when the query was cancelled before an instance was finished, or when every instance failed in the simulator.
/// The scene's outcomes are what is judged, its actions what is done.
core::Result<Foresight> foresee(const Prior& prior, std::shared_ptr<const belief::Scene> scene, double duration,
                                const belief::Effort& effort, const QueryContext& context,
                                const ForesightDetail& detail = {});

/// The instance that stands for those of `class_index` of a variable, by where they left the object; nothing when none
/// did.
std::optional<std::size_t> typical_instance(const Foresight& foresight, std::size_t variable,
                                            const std::set<int>& class_indices, std::size_t object);
/// Between two states of a run in an answer: the interval given, longer where the whole duration of it would not fit
/// into an answer (above 266 s of one object at 30 Hz).
double interval_told(const Foresight& foresight, double interval);
/// That instance again, with states every 1/30 s as far as interval_told() lets it.
std::optional<belief::Trajectory> run_again(const Foresight& foresight, const Prior& prior, std::size_t instance,
                                            const QueryContext& context);

/// The variable whose classes distinguish an object's ends: the first exclusive group about it, else the first
/// outcome about it.
std::optional<std::size_t> variable_about(const belief::Scene& scene, const std::string& object);
/// The group's name, or the outcome's.
const std::string& name_of(const simulation::Variable& variable);
/// Classes that are reported: of a single outcome its opposite is not, which is the same number again.
std::size_t reported_classes(const simulation::Variable& variable);

}  // namespace prescene::queries
