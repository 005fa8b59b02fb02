// SPDX-License-Identifier: Apache-2.0
// What it costs to weigh the poses of five things in every frame: frame terms, each thing drawn once as what hides the
// others, terms for each thing, 200 weights each.
#pragma once

#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::benchmarks {

struct TrackingCosts {
  int objects = 0;
  int hypotheses = 0;      ///< Of each.
  double triangles = 0.0;  ///< Of a thing, on average.
  double drawn = 0.0;      ///< Of the simplified meshes that are weighed.
  double pixels = 0.0;     ///< That a hypothesis covers.
  // Processor seconds a frame.
  double terms = 0.0;   ///< Of 640 x 480 for 160 x 120.
  double layers = 0.0;  ///< Each thing drawn once, and the terms that know the others.
  double weights = 0.0;
  double whole = 0.0;         ///< All three, measured together.
  double full_weights = 0.0;  ///< Weights by the full meshes.

  double share(double frames_a_second) const { return frames_a_second * whole; }
};

/// Five vases, bottles and bowls of 10,000 triangles on a table 1.1 m from the camera; one thread.
TrackingCosts tracking_costs(const rendering::LikelihoodBatch& batch, int rounds);

}  // namespace prescene::benchmarks
