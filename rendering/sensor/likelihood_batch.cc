// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/likelihood_batch.h"

#include <utility>

namespace prescene::rendering {

void temper(const FrameTerms& frame, const PoseHypothesis& hypothesis, PoseEvidence* evidence) {
  const double pixels = hypothesis.tempering_pixels > 0.0 ? hypothesis.tempering_pixels : evidence->measured;
  evidence->tempered = tempering(frame.tempering.weight, pixels, frame.step) * evidence->log_ratio;
}

std::unique_ptr<LikelihoodWorkspace> WorkspacePool::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!free_.empty()) {
      std::unique_ptr<LikelihoodWorkspace> workspace = std::move(free_.back());
      free_.pop_back();
      return workspace;
    }
  }
  return batch_->make_workspace();
}

void WorkspacePool::put(std::unique_ptr<LikelihoodWorkspace> workspace) {
  const std::lock_guard lock(mutex_);
  free_.push_back(std::move(workspace));
}

}  // namespace prescene::rendering
