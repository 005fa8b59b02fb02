// SPDX-License-Identifier: Apache-2.0
// The services of ROS 2 by which `ros2 param` and other nodes read and set the parameters of a node, and the topic on
// which it tells of what was set.
#pragma once

#include <atomic>
#include <cstdint>
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
  /// All must outlive this. `node_name` without a slash: "prescene". `on_unsent` is told of each reply and event that
  /// could not be sent, on the bus's thread.
  ParameterServices(interfaces::DdsNode& node, ParameterTable& table, const std::string& node_name, core::LogSink log,
                    std::function<void(const core::Status&)> on_unsent);
  /// Offers /NODE/list_parameters, get_parameters, get_parameter_types, describe_parameters, set_parameters and
  /// set_parameters_atomically. They are answered on the bus's thread. A request that makes no sense gets no reply,
  /// is counted, and logged.
  core::Status offer();
  /// Requests since the start that made no sense; from any thread.
  std::uint64_t refused() const { return refused_.load(std::memory_order_relaxed); }

 private:
  template <class Request, class Answer>
  core::Status offer(const std::string& name, const std::string& type, Answer answer);
  /// Logs what was set, and publishes it.
  void tell(const interfaces::RosParameter& set);

  interfaces::DdsNode& node_;
  ParameterTable& table_;
  std::string node_name_;  // "/prescene"
  core::LogSink log_;
  std::function<void(const core::Status&)> on_unsent_;
  std::atomic<std::uint64_t> refused_{0};
  interfaces::DdsPublisher events_;
};

}  // namespace prescene::service
