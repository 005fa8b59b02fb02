// SPDX-License-Identifier: Apache-2.0
// The memory of one hypothesis under way: which clusters may be seen, where their vertices are seen, and the nearest
// face at each pixel. All of it stays in the near caches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "prescene/geometry/camera.h"
#include "prescene/rendering/render_scene.h"
#include "prescene/rendering/triangle_raster.h"

namespace prescene::rendering {

/// How a mesh is seen, in single precision.
struct PoseProjection {
  PoseProjection(const geometry::Pose& X_CO, const geometry::PinholeCamera& camera);

  float rotation[9];       ///< R_CO, row by row.
  float translation[3];    ///< p_CO, m.
  float from_camera_O[3];  ///< The same in O's axes.
  float fx, fy, cx, cy, inverse_fx, inverse_fy;
  int width, height;
};

class PoseTile {
 public:
  /// Lanes that may be read beyond the last of anything.
  static constexpr std::size_t kSlack = 16;

  /// Room for a mesh and an image; grows only.
  void reserve(const RenderMesh& mesh, int width, int height);
  /// Empties the pixels of rect and those beside it.
  void clear();

  /// Of pixel (0, y); (x, y) at x from -1 to width. 1/z of the nearest face, 0 = empty. Beside the image nothing is
  /// empty, so that a border is no outline.
  float* inverse_depth(int y) { return inverse_depth_.data() + offset(y); }
  const float* inverse_depth(int y) const { return inverse_depth_.data() + offset(y); }
  /// The face of a pixel that is not empty, by its place in the mesh's clusters.
  std::int32_t* face(int y) { return face_.data() + offset(y); }
  const std::int32_t* face(int y) const { return face_.data() + offset(y); }
  std::size_t stride() const { return stride_; }

  PixelRect rect;  ///< That the object is within.

  /// Of the part that is drawn.
  float least_inverse_depth = 0.0f;
  float most_inverse_depth = 0.0f;

  /// Clusters that may be seen, in the order of the mesh, and the vertices of each in 1/256 pixel.
  std::size_t listed = 0;
  std::vector<std::int32_t> cluster;
  std::vector<std::int32_t> screen_x, screen_y;
  /// Of faces that are drawn, by their places in the mesh's clusters: n . p = distance < 0 in C, n turned to the
  /// camera.
  std::vector<float> distance;

 private:
  std::size_t offset(int y) const { return static_cast<std::size_t>(y + 1) * stride_ + kSlack; }

  int width_ = 0;
  int height_ = 0;
  std::size_t stride_ = 0;
  std::vector<float> inverse_depth_;
  std::vector<std::int32_t> face_;
};

}  // namespace prescene::rendering
