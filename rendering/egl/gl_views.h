// SPDX-License-Identifier: Apache-2.0
// The OpenGL side: a program, a frame buffer with depth, label, normal and colour images, and pixel buffers through
// which they come back while the next view is drawn. All calls, the destructor too, need the context to be current.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "gl_meshes.h"
#include "prescene/core/status.h"
#include "prescene/rendering/renderer.h"

namespace prescene::rendering {

class GlViews {
 public:
  static core::Result<std::unique_ptr<GlViews>> make();
  ~GlViews();
  GlViews(const GlViews&) = delete;
  GlViews& operator=(const GlViews&) = delete;

  int max_image_size() const { return max_image_size_; }

  /// Renderer::render. Also frees the meshes that nobody else holds any more.
  core::Status render(std::span<const RenderJob> jobs, const RenderOptions& options, std::span<RenderedView> views);

 private:
  /// The images of one view on their way back.
  struct PixelBuffer {
    unsigned name = 0;
    std::size_t size = 0;
    int width = 0;
    int height = 0;
  };

  GlViews() = default;
  core::Status make_program();
  core::Status set_size(int width, int height);
  void free_images();
  core::Status draw(const RenderJob& job, const RenderOptions& options);
  core::Status draw_instance(const RenderInstance& instance, const geometry::Pose& X_CW, unsigned label);
  void send_back(const RenderOptions& options, PixelBuffer* pixels) const;
  static core::Status take(const RenderOptions& options, const PixelBuffer& pixels, RenderedView* view);
  int uniform(const char* name) const;

  int max_image_size_ = 0;
  unsigned program_ = 0;
  // Uniform locations.
  int rotation_ = -1, translation_ = -1, projection_ = -1, clip_ = -1, label_ = -1;
  int light_ = -1, shares_ = -1, color_source_ = -1, material_ = -1;
  int width_ = 0;
  int height_ = 0;
  unsigned frame_ = 0;
  unsigned depth_image_ = 0;
  unsigned label_image_ = 0;
  unsigned normal_image_ = 0;
  unsigned color_image_ = 0;
  unsigned depth_buffer_ = 0;
  std::array<PixelBuffer, 2> pixels_;
  GlMeshes meshes_;
};

}  // namespace prescene::rendering
