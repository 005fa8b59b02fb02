// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::simulation {

/// Everything but the wall time, which may differ.
inline void expect_equal(const OutcomeEstimate& a, const OutcomeEstimate& b) {
  EXPECT_EQ(a.variables, b.variables);
  EXPECT_EQ(a.simulated_seconds, b.simulated_seconds);
  EXPECT_EQ(a.converged, b.converged);
  ASSERT_EQ(a.instances.size(), b.instances.size());
  for (std::size_t i = 0; i < a.instances.size(); ++i) {
    EXPECT_EQ(a.instances[i].component, b.instances[i].component);
    EXPECT_EQ(a.instances[i].point, b.instances[i].point);
    EXPECT_EQ(a.instances[i].weight, b.instances[i].weight);
    EXPECT_EQ(a.instances[i].classes, b.instances[i].classes);
    EXPECT_EQ(a.instances[i].final, b.instances[i].final);
  }
}

}  // namespace prescene::simulation
