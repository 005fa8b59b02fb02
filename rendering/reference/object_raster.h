// SPDX-License-Identifier: Apache-2.0
// One object drawn at a reduced resolution into memory that is reused: inverse depth and face of each pixel.
#pragma once

#include <cstdint>
#include <vector>

#include "prescene/geometry/camera.h"
#include "prescene/rendering/render_scene.h"
#include "prescene/rendering/triangle_raster.h"

namespace prescene::rendering {

/// The plane n . p = distance of a face, in C; n is turned towards the camera (distance < 0).
struct FacePlane {
  Vector3f normal;
  float distance;
};

/// Draws objects. draw() overwrites what the previous one left; allocates only while it grows.
class ObjectRaster {
 public:
  /// The part of the mesh (frame O at X_CO) from near_depth on.
  void draw(const RenderMesh& mesh, const geometry::Pose& X_CO, const geometry::PinholeCamera& camera,
            float near_depth);

  /// All pixels outside are empty; inside they may be.
  const PixelRect& rect() const { return rect_; }
  /// 1 / z of the nearest surface, 0 = empty.
  float inverse_depth(int x, int y) const { return inverse_depth_[index(x, y)]; }
  /// Of a pixel that is not empty.
  const FacePlane& face(int x, int y) const { return faces_[face_of_pixel_[index(x, y)]]; }
  /// Whether one of the four neighbours within the image is empty.
  bool at_outline(int x, int y) const;

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  void project(const RenderMesh& mesh, const geometry::Pose& X_CO, const geometry::PinholeCamera& camera,
               float near_depth, bool cut);
  void clear(const geometry::PinholeCamera& camera);
  void fill(const ScreenPoint& a, const ScreenPoint& b, const ScreenPoint& c, const FacePlane& plane);

  int width_ = 0;
  int height_ = 0;
  float inverse_fx_ = 0.0f;
  float inverse_fy_ = 0.0f;
  float cx_ = 0.0f;
  float cy_ = 0.0f;
  PixelRect rect_;
  // Of the part that is drawn: faces almost edge-on would leave it.
  float least_inverse_depth_ = 0.0f;
  float most_inverse_depth_ = 0.0f;
  std::vector<Vector3f> points_C_;
  std::vector<ScreenPoint> projected_;
  std::vector<FacePlane> faces_;
  std::vector<float> inverse_depth_;
  std::vector<std::uint32_t> face_of_pixel_;
};

}  // namespace prescene::rendering
