// SPDX-License-Identifier: Apache-2.0
// A scene with what an estimate of its outcomes takes, run with certificates and without.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/outcomes/certifier.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::simulation {

inline core::RandomStream test_stream() { return {11, core::Purpose::kTest}; }

struct Problem {
  explicit Problem(std::shared_ptr<const belief::Scene> given, const BulletOptions& options = {})
      : scene(std::move(given)) {
    ShapeStore shapes;
    simulator = *make_bullet_simulator(*scene, shapes, options);
    starts = start_of(scene);
    variables = variables_of(scene, scene->outcomes, scene->exclusive_outcomes);
    request.stop.duration = scene->duration;
  }
  OutcomeEstimate run(const EstimatorOptions& options, int threads = 2) const {
    core::ThreadPool pool(threads);
    return estimate_outcomes(*simulator, starts, variables, request, test_stream(), options, pool);
  }
  OutcomeEstimate run_exactly(int instances, const Certifier* certifier, double audit_share) const {
    EstimatorOptions options;
    options.exact_instances = instances;
    options.certifier = certifier;
    options.audit_share = audit_share;
    return run(options);
  }

  std::shared_ptr<const belief::Scene> scene;
  std::unique_ptr<Simulator> simulator;
  StartDistribution starts;
  std::vector<Variable> variables;
  RunRequest request;
};

/// How many instances have other classes than in the other estimate of the same.
inline int classed_otherwise(const OutcomeEstimate& certified, const OutcomeEstimate& whole) {
  int wrong = 0;
  for (std::size_t i = 0; i < whole.instances.size(); ++i)
    wrong += whole.instances[i].classes != certified.instances[i].classes;
  return wrong;
}

}  // namespace prescene::simulation
