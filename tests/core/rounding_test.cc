// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cstddef>

namespace prescene::core {
namespace {

// Not inlined, so that the compiler knows neither the values nor what becomes of them.
template <std::size_t n>
[[gnu::noinline]] std::array<double, n> rounded_to_float(const std::array<double, n>& values) {
  std::array<double, n> rounded{};
  for (std::size_t i = 0; i < n; ++i) rounded[i] = static_cast<double>(static_cast<float>(values[i]));
  return rounded;
}

template <std::size_t n>
void expect_rounds_to_float() {
  std::array<double, n> values{};
  for (std::size_t i = 0; i < n; ++i) values[i] = 0.1 * static_cast<double>(i + 1);
  const std::array<double, n> rounded = rounded_to_float(values);
  for (std::size_t i = 0; i < n; ++i) {
    const volatile auto alone = static_cast<float>(values[i]);
    EXPECT_EQ(rounded[i], static_cast<double>(alone)) << i << " of " << n;
  }
}

// Exact predicates and pinned bits rest on it: a double that was rounded to float is a float afterwards.
TEST(Rounding, OfDoublesToFloatHolds) {
  expect_rounds_to_float<1>();
  expect_rounds_to_float<2>();
  expect_rounds_to_float<3>();
  expect_rounds_to_float<4>();
  expect_rounds_to_float<8>();
}

}  // namespace
}  // namespace prescene::core
