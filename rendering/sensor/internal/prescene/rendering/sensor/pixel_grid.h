// SPDX-License-Identifier: Apache-2.0
// Which pixels of a full image a reduced one has: offset + step * i, in both directions.
#pragma once

#include <algorithm>

namespace prescene::rendering {

/// Pixels from one to the next, so that about `target_width` of `width` are taken.
inline int pixel_step(int width, int target_width) {
  const long long target = std::max(1, target_width);
  return static_cast<int>(std::max(1LL, (2LL * width + target) / (2 * target)));
}

/// The first of them, in rows and in columns.
inline int pixel_offset(int step, int width, int height) { return std::min({step / 2, width - 1, height - 1}); }

}  // namespace prescene::rendering
