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

  /// With the locations of its uniforms; those of colour are -1 where it draws none.
  struct Program {
    unsigned name = 0;
    int rotation = -1, translation = -1, projection = -1, clip = -1, label = -1;
    int light = -1, shares = -1, color_source = -1, material = -1;
  };

  GlViews() = default;
  core::Status make_program(bool color);
  core::Status set_size(int width, int height);
  void free_images();
  core::Status draw(const RenderJob& job, const RenderOptions& options);
  core::Status draw_instance(const RenderInstance& instance, const Program& program, const geometry::Pose& X_CW,
                             unsigned label);
  void send_back(const RenderOptions& options, PixelBuffer* pixels) const;
  static core::Status take(const RenderOptions& options, const PixelBuffer& pixels, RenderedView* view);

  int max_image_size_ = 0;
  Program plain_, colored_;
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
