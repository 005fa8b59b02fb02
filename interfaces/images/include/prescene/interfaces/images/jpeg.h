// SPDX-License-Identifier: Apache-2.0
// JPEG files, and colour images of either kind by their first bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/geometry/image.h"
#include "prescene/interfaces/images/png.h"

namespace prescene::interfaces {

/// Errors as for PNG; a cut image is kDataLoss, never a half grey picture. CMYK is kUnsupported.
core::Result<geometry::ColorImage> decode_jpeg(std::span<const std::uint8_t> bytes, const ImageLimits& limits = {});

/// `quality` 1 (small) to 100 (good), 4:2:0 below 90. Sides at most 65500 (checked).
std::vector<std::uint8_t> encode_jpeg(ColorView image, int quality = 90);

/// PNG or JPEG, whatever the bytes are.
core::Result<geometry::ColorImage> decode_color(std::span<const std::uint8_t> bytes, const ImageLimits& limits = {});
core::Result<geometry::ColorImage> read_color(const std::filesystem::path& path, const ImageLimits& limits = {});

}  // namespace prescene::interfaces
