// SPDX-License-Identifier: Apache-2.0
// How many instances a map of final positions takes to be as good as the histogram of 1000 independent ones.
#pragma once

#include <string>

#include "benchmarks/uncertain_measure.h"

namespace prescene::benchmarks {

struct MapQuality {
  /// Mean total variation between the truth and a histogram of 1000 independent instances in Bullet.
  double histogram = 0.0;
  double smallest_net = 0.0;  ///< The same of our map from 16 instances.
  double instances = 0.0;     ///< That our map takes for the histogram's quality, between sizes by powers; from 16 on.
};
/// Of the first object that the scene's outcomes judge, in cells of 2 cm. The truth is the histogram of a net of
/// `truth` instances; maps are means over `seeds` nets, histograms over as many draws.
MapQuality map_quality(const UncertainProblem& problem, int truth, int seeds);

}  // namespace prescene::benchmarks
