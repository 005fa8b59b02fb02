// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of simulation/outcomes take for granted.
#pragma once

#include <memory>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/simulation/outcomes/common_flight.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "prescene/simulation/outcomes/start_distribution.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation::given_simulation_outcomes {

extern const std::shared_ptr<const belief::Scene> scene;
extern const RunRequest request;
extern EstimatorOptions options;
extern const core::RandomStream stream;
extern core::ThreadPool pool;

namespace certifier_h {
extern const std::vector<Variable> variables;
}

namespace common_flight_h {
extern const belief::Scene scene;
extern ShapeStore shapes;
extern const StartDistribution starts;
extern const SimulatorFactory make_simulator;
}  // namespace common_flight_h

namespace first_order_h {
extern const std::vector<double> friction, weights;
extern const std::vector<int> classes;
}  // namespace first_order_h

namespace outcome_estimator_h {
extern const Simulator& simulator;
}

}  // namespace prescene::simulation::given_simulation_outcomes
