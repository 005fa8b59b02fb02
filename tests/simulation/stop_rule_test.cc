// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "prescene/belief/validation.h"
#include "prescene/simulation/simulator.h"

namespace prescene::tests {
namespace {

TEST(StopRule, EndsTheWorldWhereSceneFilesSayThatItEnds) {
  EXPECT_EQ(simulation::StopRule{}.world_radius, belief::kWorldRadius);
}

}  // namespace
}  // namespace prescene::tests
