// SPDX-License-Identifier: Apache-2.0
// DDS names and qualities of service of ROS 2 topics.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <dds/dds.h>
#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/dds/service_request.h"

namespace prescene::interfaces {

/// The descriptor that idlc made for a ROS type name, or nullptr.
const dds_topic_descriptor_t* descriptor_of(const std::string& ros_type);
/// "/a/b" -> "rt/a/b". kInvalidInput for names that ROS would refuse.
core::Result<std::string> dds_topic_name(const std::string& ros_topic);
/// "rt/a/b" -> "/a/b"; nothing for names that are not those of ROS topics.
std::optional<std::string> ros_topic_name(const std::string& dds_topic);
/// "std_msgs::msg::dds_::String_" -> "std_msgs/msg/String"; nothing for other forms.
std::optional<std::string> ros_type_name(std::string_view dds_type);

/// A type of service: what its two topics carry.
struct ServiceType {
  std::string_view name;  ///< "std_srvs/srv/Trigger"
  const dds_topic_descriptor_t* request;
  const dds_topic_descriptor_t* response;
  std::string_view request_hash, response_hash;  ///< "RIHS01_..."; "" = that of the type in schemas.h.
  ServiceForm form;
};
/// One of those that the program speaks, or nullptr.
const ServiceType* find_service_type(const std::string& ros_type);
/// "RIHS01_..." of its request, and of its reply.
std::string_view request_hash(const ServiceType& type);
std::string_view response_hash(const ServiceType& type);

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using QosPtr = std::unique_ptr<dds_qos_t, QosDeleter>;
/// With the type's hash as user data, as ROS 2 from Iron on expects of every endpoint.
QosPtr make_qos(TopicQos qos, const std::string& ros_type);
/// Of either topic of a service: rmw_cyclonedds_cpp pairs the two by their service id, 16 bytes.
QosPtr make_service_qos(const std::array<std::uint8_t, 16>& service_id, std::string_view type_hash);

}  // namespace prescene::interfaces
