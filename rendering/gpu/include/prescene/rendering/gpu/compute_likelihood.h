// SPDX-License-Identifier: Apache-2.0
// The likelihood in OpenGL compute shaders (4.3): a work group a hypothesis, thousands a dispatch, from which nothing
// but counts and sums come back.
//
//   PRESCENE_TRY(auto batch, make_compute_likelihood_batch(make_simd_likelihood_batch(), {}));
//   batch->evaluate(terms, hypotheses, *workspace, evidences);
//   if (batch->health().lost > 0) ...
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "prescene/core/status.h"
#include "prescene/rendering/gpu/graphics_devices.h"
#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

struct ComputeOptions {
  DeviceChoice device;
  /// Calls with fewer hypotheses are left to the processor: what a dispatch costs beside its work, it has done by then.
  std::size_t least_hypotheses = 1;
  std::size_t scratch_mib = 128;  ///< Memory of the device for hypotheses under way; more of them a dispatch.
  int division_error = 0;         ///< Units that quotients are put off by before they are corrected, for tests.
};

/// What became of the hypotheses so far.
struct ComputeHealth {
  std::string device;  ///< The driver's own name.
  bool software = false;
  std::uint64_t dispatches = 0;
  std::uint64_t on_device = 0;  ///< Hypotheses.
  /// Small calls, meshes that the near plane cuts, what the device has no room or no patience for or failed at.
  std::uint64_t on_processor = 0;
  std::uint64_t lost = 0;  ///< Contexts.
  bool given_up = false;   ///< After failures in a row: the processor does everything.
  core::Status last_failure;
};

class ComputeLikelihoodBatch : public LikelihoodBatch {
 public:
  virtual ComputeHealth health() const = 0;
};

/// Whether this build holds the backend.
bool compute_compiled_in();

/// Pixels, ratios and sums are those of rendering/simd bit by bit, which is what `processor` should be: whatever the
/// device can't do is done by it and nobody sees a difference. Fails with kUnavailable when no driver gives an
/// OpenGL 4.3 context without a display (the message names the package to install), or the build left it out;
/// kUnsupported when the device's arithmetic is not what is promised of it (it is tried on 4096 numbers first).
/// A call that fails on the device is done by the processor; a lost context is made again, until that failed three
/// times in a row. Calls from several threads take turns at the device.
core::Result<std::unique_ptr<ComputeLikelihoodBatch>> make_compute_likelihood_batch(
    std::unique_ptr<LikelihoodBatch> processor, const ComputeOptions& options);

}  // namespace prescene::rendering
