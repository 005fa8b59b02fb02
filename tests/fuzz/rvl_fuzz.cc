// SPDX-License-Identifier: Apache-2.0
// Width and height, a byte each, then the code.
#include <algorithm>
#include <span>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/interfaces/images/rvl.h"
#include "tests/interfaces/images/rvl_coder.h"

using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const ImageSize image_size{data[0], data[1]};
  const auto image = decode_rvl(std::span(data, size).subspan(2), image_size);
  if (!image) {
    PRESCENE_CHECK(!image.status().message().empty());
    return 0;
  }
  PRESCENE_CHECK(image->width() == image_size.width && image->height() == image_size.height);
  // Coded anew it says the same.
  const std::vector<std::uint16_t> pixels(image->data(), image->data() + image->size());
  const auto again = decode_rvl(prescene::tests::rvl_code(pixels), image_size);
  PRESCENE_CHECK(again.ok() && std::equal(pixels.begin(), pixels.end(), again->data()));
  return 0;
}
