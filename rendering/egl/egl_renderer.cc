// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/egl/egl_renderer.h"

#include <utility>

#include "gl_views.h"
#include "prescene/core/check.h"
#include "prescene/rendering/egl/egl_context.h"

namespace prescene::rendering {
namespace {

class EglRenderer final : public Renderer {
 public:
  EglRenderer(std::unique_ptr<EglContext> context, std::unique_ptr<GlViews> views)
      : context_(std::move(context)), views_(std::move(views)) {
    info_.name = "egl";
    info_.device = views_->device();
    info_.deterministic_bits = false;
    info_.depth_tolerance = 1e-4;
    info_.max_image_size = views_->max_image_size();
  }

  ~EglRenderer() override {
    const EglContext::Turn turn(*context_);
    views_.reset();
  }

  RendererInfo info() const override { return info_; }

  core::Status render(std::span<const RenderJob> jobs, const RenderOptions& options,
                      std::span<RenderedView> views) override {
    PRESCENE_CHECK(jobs.size() == views.size());
    for (const RenderJob& job : jobs) PRESCENE_RETURN_IF_ERROR(validate(job, options));
    const EglContext::Turn turn(*context_);
    PRESCENE_RETURN_IF_ERROR(turn.status());
    views_->forget_unused_meshes();
    for (std::size_t i = 0; i < jobs.size(); ++i) PRESCENE_RETURN_IF_ERROR(views_->draw(jobs[i], options, &views[i]));
    return core::ok_status();
  }

 private:
  std::unique_ptr<EglContext> context_;
  std::unique_ptr<GlViews> views_;
  RendererInfo info_;
};

}  // namespace

bool egl_compiled_in() { return true; }

core::Result<std::unique_ptr<Renderer>> make_egl_renderer(const DeviceChoice& choice) {
  PRESCENE_TRY(auto context, EglContext::make({3, 3}, choice, "OpenGL renderer"));
  std::unique_ptr<GlViews> views;
  {
    const EglContext::Turn turn(*context);
    PRESCENE_RETURN_IF_ERROR(turn.status());
    PRESCENE_TRY(views, GlViews::make());
  }
  return std::unique_ptr<Renderer>(std::make_unique<EglRenderer>(std::move(context), std::move(views)));
}

}  // namespace prescene::rendering
