// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/gpu/likelihood_choice.h"

#include <algorithm>
#include <utility>

#include "prescene/rendering/gpu/compute_likelihood.h"
#include "prescene/rendering/simd/simd_likelihood.h"

namespace prescene::rendering {
namespace {

/// A dispatch with its copies takes about as long as a few dozen small hypotheses in vector instructions (reckoned from
/// what a copy over the bus takes, not measured). Results do not depend on it.
constexpr std::size_t kWorthADispatch = 64;

bool has_graphics_card() {
  const std::vector<GraphicsDevice> devices = graphics_devices();
  return std::any_of(devices.begin(), devices.end(), [](const GraphicsDevice& device) { return !device.software; });
}

}  // namespace

core::Result<std::unique_ptr<LikelihoodBatch>> make_likelihood_batch(const LikelihoodChoice& choice) {
  std::unique_ptr<LikelihoodBatch> processor = make_simd_likelihood_batch();
  if (choice.weigher == Weigher::kProcessor) return processor;
  const bool automatic = choice.weigher == Weigher::kAutomatic;
  if (automatic && choice.device < 0 && !has_graphics_card()) return processor;
  ComputeOptions options;
  options.device.device = choice.device;
  options.device.hardware_only = automatic;
  if (automatic) options.least_hypotheses = kWorthADispatch;
  auto made = make_compute_likelihood_batch(std::move(processor), options);
  if (made) return std::unique_ptr<LikelihoodBatch>(*std::move(made));
  if (automatic && made.status().code() != core::StatusCode::kInvalidInput) return make_simd_likelihood_batch();
  return made.status();
}

}  // namespace prescene::rendering
