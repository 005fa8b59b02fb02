// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/portable_math.h"

#include <gtest/gtest.h>

#include <cmath>

namespace prescene::rendering {
namespace {

TEST(PortableMath, SinglePowersOfTwoAreWithinThreeTenMillionths) {
  for (int i = 0; i <= 100000; ++i) {
    const float x = -126.0f + 253.0f * static_cast<float>(i) / 100000.0f;
    EXPECT_NEAR(static_cast<double>(portable_exp2(x)) / std::exp2(static_cast<double>(x)), 1.0, 3e-7) << x;
  }
  for (int k = -126; k <= 127; ++k) EXPECT_EQ(portable_exp2(static_cast<float>(k)), std::ldexp(1.0f, k));
}

TEST(PortableMath, DoubleExpAndLogAreTheLibrarysButForRounding) {
  for (int i = 0; i <= 40000; ++i) {
    const double x = -700.0 + 1400.0 * i / 40000.0;
    EXPECT_NEAR(portable_exp(x) / std::exp(x), 1.0, 2e-15) << x;
    const double y = std::exp(x);
    EXPECT_NEAR(portable_log(y), std::log(y), 1e-14 * std::max(1.0, std::abs(x))) << y;
  }
  for (const double x : {1.0, 1.0 + 1e-9, 1.0 - 1e-9, 0.70710678, 1.41421357, 2.0})
    EXPECT_NEAR(portable_log(x), std::log(x), 1e-15) << x;
  EXPECT_EQ(portable_exp(0.0), 1.0);
  EXPECT_EQ(portable_log(1.0), 0.0);
  EXPECT_EQ(portable_exp(-1000.0), 0.0);
}

}  // namespace
}  // namespace prescene::rendering
