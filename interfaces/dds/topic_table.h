// SPDX-License-Identifier: Apache-2.0
// DDS names and qualities of service of ROS 2 topics.
#pragma once

#include <memory>
#include <string>

#include <dds/dds.h>
#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"

namespace prescene::interfaces {

/// The descriptor that idlc made for a ROS type name, or nullptr.
const dds_topic_descriptor_t* descriptor_of(const std::string& ros_type);
/// "/a/b" -> "rt/a/b". kInvalidInput for names that ROS would refuse.
core::Result<std::string> dds_topic_name(const std::string& ros_topic);

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPtr = std::unique_ptr<dds_qos_t, QosDeleter>;
/// With the type's hash as user data, as ROS 2 from Iron on expects of every endpoint.
QosPtr make_qos(TopicQos qos, const std::string& ros_type);

}  // namespace prescene::interfaces
