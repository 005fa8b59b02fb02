// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/likelihood_batch.h"

#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/parallel.h"

namespace prescene::rendering {

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

void evaluate_parallel(const LikelihoodBatch& batch, const FrameTerms& frame,
                       std::span<const PoseHypothesis> hypotheses, core::ThreadPool& threads, WorkspacePool& workspaces,
                       std::span<PoseEvidence> evidences) {
  PRESCENE_CHECK(hypotheses.size() == evidences.size());
  // About a fifth of a millisecond's work a block, far above what handing it to a thread costs.
  constexpr std::size_t kBlock = 16;
  threads.for_blocks(hypotheses.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    const WorkspacePool::Loan workspace(workspaces);
    batch.evaluate(frame, hypotheses.subspan(begin, end - begin), *workspace, evidences.subspan(begin, end - begin));
  });
}

}  // namespace prescene::rendering
