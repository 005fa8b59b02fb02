// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/image_messages.h"

#include <utility>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/image_view.h"

namespace prescene::service {
namespace {

using interfaces::ReceivedMessage;
using interfaces::RosCompressedImage;
using interfaces::RosImageView;
using interfaces::RosPointCloud2;

std::string form_of(const RosImageView& image) { return image.encoding; }
std::string form_of(const RosCompressedImage& image) { return image.format; }
std::string form_of(const RosPointCloud2&) { return "points"; }

template <class Message>
core::Result<Message> decoded_image(const ReceivedMessage& received) {
  return interfaces::decode_cdr<Message>(received.cdr);
}
template <>
core::Result<RosImageView> decoded_image<RosImageView>(const ReceivedMessage& received) {
  return interfaces::view_image_cdr(received.cdr);
}

template <class Message>
core::Result<DepthMessage> depth_of(const ReceivedMessage& received, const interfaces::ImageRules& rules) {
  PRESCENE_TRY(Message message, decoded_image<Message>(received));
  DepthMessage depth;
  PRESCENE_TRY(depth.depth, interfaces::to_depth_image(message, rules, &depth.report));
  depth.form = form_of(message);
  depth.header = std::move(message.header);
  return depth;
}

template <class Message>
core::Result<ColorMessage> color_of_message(const ReceivedMessage& received, const interfaces::ImageRules& rules) {
  PRESCENE_TRY(Message message, decoded_image<Message>(received));
  ColorMessage color;
  PRESCENE_TRY(color.color, interfaces::to_color_image(message, rules));
  color.form = form_of(message);
  color.header = std::move(message.header);
  return color;
}

core::Status wrong_type(const ReceivedMessage& message, const std::string& expected) {
  return core::invalid_input("carries " + message.type + ", expected " + expected +
                             ": correct the topic's name in the settings");
}

}  // namespace

std::size_t DecodedImages::bytes() const {
  std::size_t bytes = 0;
  if (depth && *depth) bytes += (*depth)->depth.size() * sizeof(float);
  if (color && *color) bytes += (*color)->color.size() * sizeof(geometry::Rgb);
  return bytes;
}

core::Result<DepthMessage> decode_depth(const ReceivedMessage& message, const interfaces::ImageRules& rules) {
  if (message.type == "sensor_msgs/msg/Image") return depth_of<RosImageView>(message, rules);
  if (message.type == "sensor_msgs/msg/CompressedImage") return depth_of<RosCompressedImage>(message, rules);
  if (message.type == "sensor_msgs/msg/PointCloud2") return depth_of<RosPointCloud2>(message, rules);
  return wrong_type(message, "sensor_msgs/msg/Image, CompressedImage or PointCloud2");
}

core::Result<ColorMessage> decode_color_message(const ReceivedMessage& message, const interfaces::ImageRules& rules) {
  if (message.type == "sensor_msgs/msg/Image") return color_of_message<RosImageView>(message, rules);
  if (message.type == "sensor_msgs/msg/CompressedImage") return color_of_message<RosCompressedImage>(message, rules);
  return wrong_type(message, "sensor_msgs/msg/Image or CompressedImage");
}

}  // namespace prescene::service
