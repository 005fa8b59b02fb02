// SPDX-License-Identifier: Apache-2.0
// The rays through all pixels of a camera, with one division for each column and row instead of two for each pixel.
//
//   const PixelRays rays(camera);
//   const Vector3d p_C = rays.unproject(x, y, depth(x, y));
#pragma once

#include <cstddef>
#include <vector>

#include "prescene/geometry/camera.h"

namespace prescene::geometry {

class PixelRays {
 public:
  explicit PixelRays(const PinholeCamera& camera) {
    across_.reserve(static_cast<std::size_t>(camera.width));
    down_.reserve(static_cast<std::size_t>(camera.height));
    for (int x = 0; x < camera.width; ++x) across_.push_back((x - camera.cx) / camera.fx);
    for (int y = 0; y < camera.height; ++y) down_.push_back((y - camera.cy) / camera.fy);
  }

  /// The bits of camera.unproject(x, y, depth), of a pixel of the image.
  Vector3d unproject(int x, int y, double depth) const {
    return {across_[static_cast<std::size_t>(x)] * depth, down_[static_cast<std::size_t>(y)] * depth, depth};
  }

 private:
  std::vector<double> across_;
  std::vector<double> down_;
};

}  // namespace prescene::geometry
