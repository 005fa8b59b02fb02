// SPDX-License-Identifier: Apache-2.0
// What predictions and the question of stability have to reach: are stated probabilities those with which things
// happen, and how long does it take?
#pragma once

#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// `scenes` random scenes: something is put down, dropped or pushed along near a table's edge, with or without a second
/// thing beside it or below it. Each is predicted from its priors, and happens 16 times: starts from the priors, by
/// Bullet's stepper at 1/1000 s.
Table measure_prediction_calibration(int scenes, Report* report);

/// Each of the five things of scenarios/five_objects_pushed.yaml, `seeds` times: does it stay, to +-0.025?
Table measure_stability_time(int seeds, Report* report);

}  // namespace prescene::benchmarks
