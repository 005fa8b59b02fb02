// SPDX-License-Identifier: Apache-2.0
// The services of ROS 2 by which `ros2 param` and other nodes read and set the parameters of a node, and the topic on
// which it tells of what was set.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "prescene/core/log.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/service/live/node_parameters.h"

namespace prescene::service {

inline constexpr const char* kParameterEventsTopic = "/parameter_events";

class ParameterServices {
 public:
  /// All must outlive this. `node_name` without a slash: "prescene".
  ParameterServices(interfaces::DdsNode& node, ParameterTable& table, const std::string& node_name, core::LogSink log);
  /// Offers /NODE/list_parameters, get_parameters, get_parameter_types, describe_parameters, set_parameters and
  /// set_parameters_atomically. They are answered on the bus's thread. A request that makes no sense gets no reply,
  /// and is logged.
  core::Status offer();

 private:
  template <class Request, class Answer>
  core::Status offer(const std::string& name, const std::string& type, Answer answer);
  /// Logs what was set, and publishes it.
  void tell(const interfaces::RosParameter& set);

  interfaces::DdsNode& node_;
  ParameterTable& table_;
  std::string node_name_;  // "/prescene"
  core::LogSink log_;
  interfaces::DdsPublisher events_;
};

}  // namespace prescene::service
