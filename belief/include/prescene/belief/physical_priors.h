// SPDX-License-Identifier: Apache-2.0
// The priors of a model's physical parameters by name: what the draws of a PhysicalBelief are uniform numbers of.
#pragma once

#include <string>
#include <vector>

#include "prescene/belief/distribution.h"
#include "prescene/belief/object_model.h"

namespace prescene::belief {

/// A parameter and what is known of it before any evidence.
struct PhysicalPrior {
  std::string name;  ///< As ParameterEstimate::name.
  ScalarDistribution prior;
  friend bool operator==(const PhysicalPrior&, const PhysicalPrior&) = default;
};
/// Of all parameters of a model, in the order of physical_at: those that are known exactly take no uniform number.
std::vector<PhysicalPrior> physical_priors(const ObjectModel& model);

}  // namespace prescene::belief
