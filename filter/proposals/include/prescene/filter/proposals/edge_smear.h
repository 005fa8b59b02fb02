// SPDX-License-Identifier: Apache-2.0
// How sharply a depth camera shows where a surface ends. Real ones move this by some pixels: a near surface reaches too
// far or not far enough, and depth is registered to colour with errors. The depth image alone does not show it, as its
// edges look no worse for that; but the colour image shows the same edges.
//
//   const EdgeSmear smear = measure_edge_smear(*frame.depth, frame.color.get());
//   const int pixels_beside_the_edge = smear.is_sharp() ? 2 : 8;
#pragma once

#include "prescene/geometry/image.h"

namespace prescene::filter {

struct EdgeSmear {
  double pixels = 0.0;  ///< Of the full image: 68 % of the edges in depth are no further from those in colour.
  int edges = 0;        ///< From so many crossings of edges it was measured; 0 = too few to tell, and `pixels` is 0.

  /// Whether surfaces end within a pixel of where they seem to. False where too few edges tell.
  bool is_sharp() const { return edges > 0 && pixels <= 1.0; }
};

/// Along all rows and columns of a frame (depth in m, 0 = none; colour of the same size), where a surface of some
/// pixels ends in front of another one, at least 4 cm further away, with at most three pixels between them that show
/// neither: how far from there the colours change most, at most ten pixels away. Edges at which colours hardly change
/// are left out. Fewer than 60 crossings are too few, as is a frame without colour (null).
EdgeSmear measure_edge_smear(const geometry::DepthImage& depth, const geometry::ColorImage* color);

}  // namespace prescene::filter
