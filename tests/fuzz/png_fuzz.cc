// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/check.h"
#include "prescene/interfaces/images/png.h"

using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  const ImageLimits limits{.max_side = 4096, .max_pixels = 1 << 20};
  const auto header = decode_png_size(bytes, limits);
  const auto color = decode_png_color(bytes, limits);
  const auto depth = decode_png_depth(bytes, 0.001, limits);
  const auto label = decode_png_label(bytes, limits);
  if (color) PRESCENE_CHECK(header.ok() && color->width() == header->width && color->height() == header->height);
  if (depth) {
    PRESCENE_CHECK(label.ok());
    for (std::size_t i = 0; i < depth->size(); ++i)
      PRESCENE_CHECK(depth->data()[i] >= 0.0F && depth->data()[i] < 65.535F);
  }
  if (label) PRESCENE_CHECK(color.ok());
  return 0;
}
