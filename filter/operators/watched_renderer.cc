// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/watched_renderer.h"

#include <utility>

namespace prescene::filter {

core::Status WatchedRenderer::render(std::span<const rendering::RenderJob> jobs,
                                     const rendering::RenderOptions& options,
                                     std::span<rendering::RenderedView> views) {
  core::Status status = renderer_.render(jobs, options, views);
  if (!status.ok()) {
    const std::lock_guard lock(mutex_);
    if (failures_.count++ == 0) failures_.first = status;
  }
  return status;
}

RenderFailures WatchedRenderer::take_failures() {
  const std::lock_guard lock(mutex_);
  return std::exchange(failures_, {});
}

}  // namespace prescene::filter
