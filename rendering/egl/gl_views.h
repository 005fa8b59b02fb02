// SPDX-License-Identifier: Apache-2.0
// The OpenGL side: a program, a frame buffer with depth, label and normal images, and meshes in the device's memory.
// All calls, the destructor too, need the context to be current.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/rendering/renderer.h"

namespace prescene::rendering {

/// Draws one view after the other.
class GlViews {
 public:
  static core::Result<std::unique_ptr<GlViews>> make();
  ~GlViews();
  GlViews(const GlViews&) = delete;
  GlViews& operator=(const GlViews&) = delete;

  /// The driver's own name.
  const std::string& device() const { return device_; }
  int max_image_size() const { return max_image_size_; }

  core::Status draw(const RenderJob& job, const RenderOptions& options, RenderedView* view);
  /// Frees the meshes that nobody else holds any more.
  void forget_unused_meshes();

 private:
  struct UploadedMesh {
    std::weak_ptr<const RenderMesh> mesh;
    unsigned vertex_array = 0;
    unsigned buffer = 0;
    int vertices = 0;
  };

  GlViews() = default;
  core::Status make_program();
  core::Status set_size(int width, int height);
  void free_images();
  const UploadedMesh& uploaded(const MeshHandle& mesh);
  void read_back(const RenderOptions& options, RenderedView* view);

  std::string device_;
  int max_image_size_ = 0;
  unsigned program_ = 0;
  int rotation_ = -1;  ///< Uniform locations.
  int translation_ = -1;
  int projection_ = -1;
  int clip_ = -1;
  int label_ = -1;
  int width_ = 0;
  int height_ = 0;
  unsigned frame_ = 0;
  unsigned depth_image_ = 0;
  unsigned label_image_ = 0;
  unsigned normal_image_ = 0;
  unsigned depth_buffer_ = 0;
  std::map<const RenderMesh*, UploadedMesh> meshes_;
};

}  // namespace prescene::rendering
