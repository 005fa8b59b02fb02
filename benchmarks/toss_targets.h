// SPDX-License-Identifier: Apache-2.0
// Recorded tosses of a cube: how well they are forecast by models that were fitted to other tosses, and what a fit
// takes.
#pragma once

#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// Tosses at odd places by the shipped model. In `folds` parts (0: not done), each by a calibration of the others. Wall
/// time of a calibration on the tosses at even places, with two threads; not done where folds are not. Where the data
/// are absent the targets say so.
void measure_tosses(int folds, Report* report);

}  // namespace prescene::benchmarks
