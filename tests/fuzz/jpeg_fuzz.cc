// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/check.h"
#include "prescene/interfaces/images/jpeg.h"

using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto color = decode_jpeg({data, size}, {.max_side = 4096, .max_pixels = 1 << 18});
  if (color) PRESCENE_CHECK(!color->empty() && color->size() <= 1 << 18);
  return 0;
}
