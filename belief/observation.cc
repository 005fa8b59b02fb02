// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/observation.h"

namespace prescene::belief {
namespace {

template <class Image>
bool same_image(const std::shared_ptr<const Image>& a, const std::shared_ptr<const Image>& b) {
  return a == b || (a && b && *a == *b);
}

}  // namespace

bool operator==(const RgbdFrame& a, const RgbdFrame& b) {
  return same_image(a.depth, b.depth) && same_image(a.color, b.color) && a.camera == b.camera;
}

}  // namespace prescene::belief
