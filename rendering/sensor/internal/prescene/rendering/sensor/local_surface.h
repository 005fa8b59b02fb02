// SPDX-License-Identifier: Apache-2.0
// The surface at a pixel of a measured depth image, from its neighbours: what the pixel itself returned can then be
// judged by it.
#pragma once

#include <cstdint>
#include <optional>

#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"

namespace prescene::rendering {

struct LocalSurfaceOptions {
  int window = 3;  ///< Pixels each way.
  /// m; neighbours further than this from a plane through their middle are of another surface.
  double same_surface = 0.015;
  double fewest = 0.5;  ///< Share of the window's pixels that must be measured, of one surface.
};

struct LocalSurface {
  double depth = 0.0;   ///< m, of the plane at the pixel.
  double cosine = 1.0;  ///< |n . ray|
};

/// A plane of least squares over the neighbours of (x, y) that are of one surface, without that pixel; 0 = not
/// measured. Nothing where too few are of one surface.
std::optional<LocalSurface> local_surface(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera,
                                          int x, int y, const LocalSurfaceOptions& options = {});

/// Of each pixel, how far the nearest pixel that is not 0 in `marked` is, in pixels: by two sweeps over the eight
/// neighbours (chamfer), exact along rows, columns and diagonals. 1e6 where none is marked.
geometry::Image<float> distance_to_marked(const geometry::Image<std::uint8_t>& marked);

}  // namespace prescene::rendering
