// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of simulation/calibration take for granted.
#pragma once

#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/simulation/calibration/flight_calibration.h"
#include "prescene/simulation/calibration/m_estimate.h"
#include "prescene/simulation/calibration/motion_calibration.h"
#include "prescene/simulation/calibration/motion_forecast.h"

namespace prescene::simulation::given_simulation_calibration {

extern const core::RandomStream stream;

namespace flight_calibration_h {
extern const FlightPrior prior;
}

namespace m_estimate_h {
extern const std::vector<EstimatedParameter> parameters;
extern const Observations observations;
extern const SimulatedPoints simulate;
}  // namespace m_estimate_h

namespace motion_calibration_h {
extern const std::vector<RecordedMotion> motions;
extern const belief::Scene scene;
extern const SimulatorFactory make_simulator;
extern core::ThreadPool pool;
}  // namespace motion_calibration_h

namespace motion_forecast_h {
extern const std::vector<RecordedMotion> motions;
extern const std::vector<std::size_t> numbers;
extern const belief::Scene scene;
extern const ThrowScatter scatter;
extern const SimulatorFactory make_simulator;
extern core::ThreadPool pool;
}  // namespace motion_forecast_h

}  // namespace prescene::simulation::given_simulation_calibration
