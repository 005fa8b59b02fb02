// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <span>

#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::filter_tests {

/// Counts the poses that frames are compared with.
class CountingLikelihood final : public rendering::LikelihoodBatch {
 public:
  explicit CountingLikelihood(const rendering::LikelihoodBatch& batch) : batch_(batch) {}
  rendering::LikelihoodBatchInfo info() const override { return batch_.info(); }
  std::unique_ptr<rendering::LikelihoodWorkspace> make_workspace() const override { return batch_.make_workspace(); }
  void evaluate(const rendering::FrameTerms& frame, std::span<const rendering::PoseHypothesis> hypotheses,
                rendering::LikelihoodWorkspace& workspace,
                std::span<rendering::PoseEvidence> evidences) const override {
    poses += static_cast<int>(hypotheses.size());
    batch_.evaluate(frame, hypotheses, workspace, evidences);
  }
  void linearise(const rendering::FrameTerms& frame, std::span<const rendering::PoseHypothesis> hypotheses,
                 const rendering::LineariseOptions& options, rendering::LikelihoodWorkspace& workspace,
                 std::span<rendering::PoseLinearisation> linearisations) const override {
    poses += static_cast<int>(hypotheses.size());
    batch_.linearise(frame, hypotheses, options, workspace, linearisations);
  }
  mutable std::atomic<int> poses = 0;

 private:
  const rendering::LikelihoodBatch& batch_;
};

}  // namespace prescene::filter_tests
