// SPDX-License-Identifier: Apache-2.0
// Depth and colour out of any message that carries them: sensor_msgs/Image, CompressedImage, PointCloud2.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service {

struct DepthMessage {
  interfaces::RosHeader header;
  geometry::DepthImage depth;
  interfaces::DepthImageReport report;
  std::string form;  ///< How it came: "16UC1", "16UC1; compressedDepth png", "points".
};
struct ColorMessage {
  interfaces::RosHeader header;
  geometry::ColorImage color;
  std::string form;  ///< "rgb8", "bgr8; jpeg compressed bgr8"
};

/// The images of one message where they were made before its turn; neither where there are none, or nobody made them.
struct DecodedImages {
  std::optional<core::Result<DepthMessage>> depth;
  std::optional<core::Result<ColorMessage>> color;

  bool any() const { return depth || color; }
  std::size_t bytes() const;
};

/// Errors of decode_cdr and to_depth_image; kInvalidInput for a type that carries no depth.
core::Result<DepthMessage> decode_depth(const interfaces::ReceivedMessage& message,
                                        const interfaces::ImageRules& rules = {});
core::Result<ColorMessage> decode_color_message(const interfaces::ReceivedMessage& message,
                                                const interfaces::ImageRules& rules = {});

}  // namespace prescene::service
