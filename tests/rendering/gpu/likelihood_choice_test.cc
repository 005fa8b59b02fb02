// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/gpu/likelihood_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "prescene/rendering/gpu/compute_likelihood.h"

namespace prescene::rendering {
namespace {

std::string name_of(const LikelihoodChoice& choice) {
  const auto batch = make_likelihood_batch(choice);
  return batch ? (*batch)->info().name : "";
}

TEST(LikelihoodChoice, TakesWhatItIsTold) {
  EXPECT_EQ(name_of({Weigher::kProcessor}), "simd");
  const auto on_graphics = make_likelihood_batch({Weigher::kGraphics});
  if (on_graphics) {
    EXPECT_STREQ((*on_graphics)->info().name, "compute");
    EXPECT_EQ((*on_graphics)->info().good_call, 1u);
  } else {
    EXPECT_EQ(on_graphics.status().code(), core::StatusCode::kUnavailable);
  }
}

TEST(LikelihoodChoice, TakesSoftwareRenderersWhenToldOnly) {
  const std::vector<GraphicsDevice> devices = graphics_devices();
  const bool card = std::any_of(devices.begin(), devices.end(), [](const auto& device) { return !device.software; });
  if (!card) {
    EXPECT_EQ(name_of({}), "simd");
  } else {
    EXPECT_NE(name_of({}), "");
  }
  for (const GraphicsDevice& device : devices) {
    if (!device.software) continue;
    EXPECT_EQ(name_of({Weigher::kAutomatic, device.index}), "simd");
    EXPECT_EQ(name_of({Weigher::kGraphics, device.index}), "compute");
  }
}

TEST(LikelihoodChoice, RefusesADeviceThatIsNotListed) {
  const int beyond = static_cast<int>(graphics_devices().size());
  for (const Weigher weigher : {Weigher::kAutomatic, Weigher::kGraphics}) {
    const auto batch = make_likelihood_batch({weigher, beyond});
    ASSERT_FALSE(batch.ok());
    EXPECT_EQ(batch.status().code(), core::StatusCode::kInvalidInput) << batch.status().message();
  }
}

}  // namespace
}  // namespace prescene::rendering
