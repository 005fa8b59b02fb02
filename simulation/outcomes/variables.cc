// SPDX-License-Identifier: Apache-2.0
// Outcomes of a scene as variables of the estimator.
#include <utility>

#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::simulation {

std::vector<Variable> variables_of(const std::shared_ptr<const belief::Scene>& scene,
                                   std::vector<belief::Outcome> outcomes,
                                   std::vector<belief::ExclusiveOutcomes> exclusive_outcomes) {
  std::vector<Variable> variables;
  for (belief::ExclusiveOutcomes& group : exclusive_outcomes) {
    Variable& variable = variables.emplace_back();
    variable.name = group.name;
    for (const belief::Outcome& outcome : group.outcomes) variable.classes.push_back(outcome.name);
    variable.classes.push_back("other");
    variable.outcomes = group.outcomes;
    variable.classify = [scene, group = std::move(group)](const belief::Trajectory& trajectory) {
      return belief::classify(*scene, trajectory, group);
    };
  }
  for (belief::Outcome& outcome : outcomes) {
    Variable& variable = variables.emplace_back();
    variable.classes = {outcome.name, "not " + outcome.name};
    variable.outcomes = {outcome};
    variable.classify = [scene, outcome = std::move(outcome)](const belief::Trajectory& trajectory) {
      return belief::holds(*scene, trajectory, outcome) ? 0 : 1;
    };
  }
  return variables;
}

}  // namespace prescene::simulation
