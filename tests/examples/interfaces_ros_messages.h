// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/ros_messages take for granted.
#pragma once

#include <cstdint>
#include <vector>

#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::interfaces::given_interfaces_ros_messages {

extern const RosImage image;

namespace image_view_h {
extern const std::vector<std::uint8_t> bytes;
}  // namespace image_view_h

}  // namespace prescene::interfaces::given_interfaces_ros_messages
