// SPDX-License-Identifier: Apache-2.0
// What predictions of actions have to reach: the same as plain runs in fine steps.
#pragma once

#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// Eight scenes of scenarios/ in which things slip, are bumped, pushed, opened, poured, inserted, stacked and put down.
/// Each is predicted from its priors to +-0.005, and run `runs` times by Bullet's stepper at 1/2000 s. A scene agrees
/// where every probability is within the interval of the runs: of Wilson's, with a confidence of 95 % for all of the
/// scene's probabilities together.
Table measure_actions(int runs, Report* report);

}  // namespace prescene::benchmarks
