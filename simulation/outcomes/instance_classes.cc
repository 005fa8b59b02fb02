// SPDX-License-Identifier: Apache-2.0
#include "instance_classes.h"

#include "prescene/core/check.h"

namespace prescene::simulation {

std::vector<int> classes_of(const belief::Trajectory& run, std::span<const Variable> variables,
                            const Certifier* certifier, double duration) {
  PRESCENE_CHECK(run.end != belief::TrajectoryEnd::kCancelled);
  if (run.end == belief::TrajectoryEnd::kDiverged) return std::vector<int>(variables.size(), -1);
  std::vector<int> classes;
  if (run.end == belief::TrajectoryEnd::kDecided) {
    PRESCENE_CHECK_MSG(certifier, "a run was decided by nobody");
    std::optional<std::vector<int>> decided = certifier->classes(run.final(), duration - run.simulated_seconds);
    PRESCENE_CHECK_MSG(decided, "a certifier that answers differently when it is asked again");
    classes = *std::move(decided);
  } else {
    for (const Variable& variable : variables) classes.push_back(variable.classify(run));
  }
  PRESCENE_CHECK(classes.size() == variables.size());
  for (std::size_t v = 0; v < variables.size(); ++v)
    PRESCENE_CHECK(classes[v] >= 0 && static_cast<std::size_t>(classes[v]) < variables[v].classes.size());
  return classes;
}

}  // namespace prescene::simulation
