// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/dds take for granted.
#pragma once

#include "prescene/core/log.h"
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::interfaces::given_interfaces_dds {

extern const DdsOptions options;
extern const core::LogSink log;
void on_image(ReceivedMessage&& message);

}  // namespace prescene::interfaces::given_interfaces_dds
