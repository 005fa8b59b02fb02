// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/likelihood_batch.h"

#include <utility>

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

}  // namespace prescene::rendering
