// SPDX-License-Identifier: Apache-2.0
// A renderer that remembers what failed, for callers that go on without the picture.
//
//   WatchedRenderer watched(renderer);
//   ... depth_of(target, X_CO, camera, watched)
//   if (const RenderFailures failures = watched.take_failures(); failures.count > 0) ...
#pragma once

#include <mutex>

#include "prescene/rendering/renderer.h"

namespace prescene::filter {

struct RenderFailures {
  int count = 0;       ///< Calls that failed.
  core::Status first;  ///< Why the first of them did; ok = none.
};

/// Forwards to another renderer, which must outlive it.
class WatchedRenderer final : public rendering::Renderer {
 public:
  explicit WatchedRenderer(rendering::Renderer& renderer) : renderer_(renderer) {}

  rendering::RendererInfo info() const override { return renderer_.info(); }
  using rendering::Renderer::render;
  core::Status render(std::span<const rendering::RenderJob> jobs, const rendering::RenderOptions& options,
                      std::span<rendering::RenderedView> views) override;

  /// What failed since the last call of this.
  RenderFailures take_failures();

 private:
  rendering::Renderer& renderer_;
  std::mutex mutex_;
  RenderFailures failures_;
};

}  // namespace prescene::filter
