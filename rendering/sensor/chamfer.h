// SPDX-License-Identifier: Apache-2.0
// Distances over an image in two sweeps.
#pragma once

namespace prescene::rendering {

/// Calls relax(x, y, dx, dy, length) for each pixel and its neighbours, in an order after which each pixel has heard of
/// the nearest of those from which distances spread: 1 along rows and columns, sqrt(2) across. Neighbours may lie
/// outside of the image.
template <class Relax>
void sweep_neighbours(int width, int height, const Relax& relax) {
  constexpr float kDiagonal = 1.41421356f;
  const auto sweep = [&](int x, int y, int back) {
    relax(x, y, back, 0, 1.0f);
    relax(x, y, 0, back, 1.0f);
    relax(x, y, back, back, kDiagonal);
    relax(x, y, -back, back, kDiagonal);
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) sweep(x, y, -1);
  for (int y = height - 1; y >= 0; --y)
    for (int x = width - 1; x >= 0; --x) sweep(x, y, 1);
}

}  // namespace prescene::rendering
