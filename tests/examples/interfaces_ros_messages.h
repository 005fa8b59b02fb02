// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/ros_messages take for granted.
#pragma once

#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::interfaces::given_interfaces_ros_messages {

extern const RosImage image;

}  // namespace prescene::interfaces::given_interfaces_ros_messages
