// SPDX-License-Identifier: Apache-2.0
// How far measured depth lies from where the belief has the surface of each object.
//
//   ResidualMeter meter(backends);
//   const std::map<std::string, double> residuals = meter.measure(scene, summary, observation);
#pragma once

#include <map>
#include <memory>
#include <string>

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/rendering/renderer.h"
#include "prescene/service/backends.h"
#include "prescene/service/belief_summary.h"

namespace prescene::service {

class ResidualMeter {
 public:
  /// `backends` must outlive the meter.
  explicit ResidualMeter(Backends& backends) : backends_(&backends) {}

  /// By object, m: the median of |measured - expected depth| over the pixels (of an image sampled to about 160 columns)
  /// that show the object where the belief has it, as far as they are within 5 cm: what is further off is something
  /// else. Objects with fewer than 10 such pixels are left out; all are, where the renderer fails.
  std::map<std::string, double> measure(const belief::Scene& scene, const BeliefSummary& summary,
                                        const belief::Observation& observation);

 private:
  Backends* backends_;
  std::unique_ptr<rendering::Renderer> renderer_;
};

}  // namespace prescene::service
