// SPDX-License-Identifier: Apache-2.0
// RVL, the lossless coding of 16-bit depth images that ROS's compressed_depth_image_transport sends [Wilson 2017].
#pragma once

#include <cstdint>
#include <span>

#include "prescene/core/status.h"
#include "prescene/geometry/image.h"
#include "prescene/interfaces/images/png.h"

namespace prescene::interfaces {

/// Decodes the code words of an image of this size. Bytes: 32-bit words, little endian, of eight 4-bit digits each, the
/// upper ones first. kInvalidInput for an empty size, kResourceExhausted above the limits, kDataLoss when the words end
/// before the image does, describe more pixels than it has, or are left over.
core::Result<geometry::Image<std::uint16_t>> decode_rvl(std::span<const std::uint8_t> bytes, ImageSize size,
                                                        const ImageLimits& limits = {});

}  // namespace prescene::interfaces
