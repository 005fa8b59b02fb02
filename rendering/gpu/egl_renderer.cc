// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/gpu/egl_renderer.h"

#include <mutex>
#include <utility>

#include "gl_views.h"
#include "prescene/core/check.h"
#include "prescene/rendering/gpu/egl_context.h"

namespace prescene::rendering {
namespace {

/// A context and what lives in it.
class Device {
 public:
  static core::Result<std::unique_ptr<Device>> make(const DeviceChoice& choice) {
    PRESCENE_TRY(auto context, EglContext::make({3, 3}, choice, "OpenGL renderer"));
    std::unique_ptr<Device> device(new Device(std::move(context)));
    const EglContext::Turn turn(*device->context_);
    PRESCENE_RETURN_IF_ERROR(turn.status());
    PRESCENE_TRY(device->views_, GlViews::make());
    return device;
  }
  ~Device() {
    const EglContext::Turn turn(*context_);
    // In a lost context there is nothing left to free.
    views_.reset();
  }
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  const std::string& name() const { return context_->device(); }
  int max_image_size() const { return views_->max_image_size(); }

  core::Status render(std::span<const RenderJob> jobs, const RenderOptions& options, std::span<RenderedView> views) {
    const EglContext::Turn turn(*context_);
    PRESCENE_RETURN_IF_ERROR(turn.status());
    PRESCENE_RETURN_IF_ERROR(views_->render(jobs, options, views));
    return turn.reset_status();
  }

 private:
  explicit Device(std::unique_ptr<EglContext> context) : context_(std::move(context)) {}

  std::unique_ptr<EglContext> context_;
  std::unique_ptr<GlViews> views_;
};

class EglRenderer final : public Renderer {
 public:
  EglRenderer(DeviceChoice choice, std::unique_ptr<Device> device)
      : choice_(std::move(choice)), device_(std::move(device)) {
    describe();
  }

  RendererInfo info() const override {
    const std::lock_guard lock(mutex_);
    return info_;
  }

  core::Status render(std::span<const RenderJob> jobs, const RenderOptions& options,
                      std::span<RenderedView> views) override {
    PRESCENE_CHECK(jobs.size() == views.size());
    for (const RenderJob& job : jobs) PRESCENE_RETURN_IF_ERROR(validate(job, options));
    const std::lock_guard lock(mutex_);
    // A second time in a context made anew: everything that was in the old one is sent again as it is drawn.
    core::Status status;
    for (int attempt = 0; attempt < 2; ++attempt) {
      if (device_ == nullptr) {
        PRESCENE_TRY(device_, Device::make(choice_));
        describe();
      }
      status = device_->render(jobs, options, views);
      if (status.code() != core::StatusCode::kUnavailable) return status;
      device_.reset();
    }
    return status;
  }

 private:
  void describe() {
    info_.name = "egl";
    info_.device = device_->name();
    info_.deterministic_bits = false;
    info_.depth_tolerance = 1e-4;
    info_.max_image_size = device_->max_image_size();
  }

  DeviceChoice choice_;
  mutable std::mutex mutex_;  // guards what follows
  std::unique_ptr<Device> device_;
  RendererInfo info_;
};

}  // namespace

bool egl_compiled_in() { return true; }

core::Result<std::unique_ptr<Renderer>> make_egl_renderer(const DeviceChoice& choice) {
  PRESCENE_TRY(auto device, Device::make(choice));
  return std::unique_ptr<Renderer>(std::make_unique<EglRenderer>(choice, std::move(device)));
}

}  // namespace prescene::rendering
