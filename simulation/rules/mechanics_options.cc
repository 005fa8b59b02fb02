// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/rules/mechanics_options.h"

namespace prescene::simulation {

core::Status validate(const MechanicsOptions& options) {
  const auto in = [](double value, double low, double high) { return value >= low && value <= high; };
  if (!in(options.step, 1e-5, 0.02)) return core::invalid_input("step must be in [1e-5, 0.02] s");
  if (options.solver_iterations < 1 || options.solver_iterations > 1000) {
    return core::invalid_input("solver_iterations must be in [1, 1000]");
  }
  if (!in(options.overlap_recovery, 1e-6, 1.0)) return core::invalid_input("overlap_recovery must be in [1e-6, 1]");
  if (!in(options.restitution_speed, 0.0, 100.0)) {
    return core::invalid_input("restitution_speed must be in [0, 100] m/s");
  }
  if (!in(options.impact_speed, 0.0, 100.0)) return core::invalid_input("impact_speed must be in [0, 100] m/s");
  if (!in(options.edge_rounding, 1e-5, 0.01)) return core::invalid_input("edge_rounding must be in [1e-5, 0.01] m");
  if (!in(options.touching_distance, 0.0, 0.1)) return core::invalid_input("touching_distance must be in [0, 0.1] m");
  if (!in(options.contact_merge_time, 0.0, 10.0)) return core::invalid_input("contact_merge_time must be in [0, 10] s");
  if (!in(options.rest.energy, 0.0, 1e3)) return core::invalid_input("rest.energy must be in [0, 1000] J/kg");
  if (!in(options.rest.time, 0.0, 1e3)) return core::invalid_input("rest.time must be in [0, 1000] s");
  return core::ok_status();
}

}  // namespace prescene::simulation
