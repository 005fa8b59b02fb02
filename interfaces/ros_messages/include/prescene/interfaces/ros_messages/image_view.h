// SPDX-License-Identifier: Apache-2.0
// sensor_msgs/Image read where its bytes are. An image is nearly all pixels, and whoever makes depth or colour of it
// copies them anyway.
//
//   PRESCENE_TRY(const RosImageView image, view_image_cdr(bytes));
//   PRESCENE_TRY(const geometry::DepthImage depth, to_depth_image(image));
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "prescene/core/status.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::interfaces {

/// A RosImage without its pixels: they are in somebody else's memory, which must outlive it.
struct RosImageView {
  RosHeader header;
  std::uint32_t height = 0;
  std::uint32_t width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;
  std::span<const std::uint8_t> data;
};
RosImageView view_of(const RosImage& image);

/// decode_cdr<RosImage>, with its errors, but the pixels stay where they are in `bytes`.
core::Result<RosImageView> view_image_cdr(std::span<const std::uint8_t> bytes, const CdrLimits& limits = {});

/// As those of RosImage (conversions.h).
core::Result<geometry::DepthImage> to_depth_image(const RosImageView& image, const ImageRules& rules = {},
                                                  DepthImageReport* report = nullptr);
core::Result<geometry::ColorImage> to_color_image(const RosImageView& image, const ImageRules& rules = {});

}  // namespace prescene::interfaces
