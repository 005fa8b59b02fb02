// SPDX-License-Identifier: Apache-2.0
#include "parameter_services.h"

#include <utility>

#include "prescene/core/clock.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service {
namespace {

std::string text_of(const ParameterValue& value) {
  if (const auto* truth = std::get_if<bool>(&value)) return *truth ? "true" : "false";
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  if (const auto* number = std::get_if<double>(&value)) return interfaces::number_text(*number);
  if (const auto* text = std::get_if<std::string>(&value)) return interfaces::quote(*text);
  return "an array";
}

}  // namespace

ParameterServices::ParameterServices(interfaces::DdsNode& node, ParameterTable& table, const std::string& node_name,
                                     core::LogSink log, std::function<void(const core::Status&)> on_unsent)
    : node_(node), table_(table), node_name_("/" + node_name), log_(std::move(log)), on_unsent_(std::move(on_unsent)) {}

template <class Request, class Answer>
core::Status ParameterServices::offer(const std::string& name, const std::string& type, Answer answer) {
  return node_.offer_service(
      node_name_ + "/" + name, "rcl_interfaces/srv/" + type,
      [this, name, answer = std::move(answer)](interfaces::ServiceRequest&& request) {
        const auto asked = interfaces::decode_cdr<Request>(request.fields, interfaces::kSmallMessage);
        if (!asked) {
          refused_.fetch_add(1, std::memory_order_relaxed);
          core::log(log_, core::LogLevel::kWarning,
                    node_name_ + "/" + name + ": a request was refused: " + asked.status().message());
          return;
        }
        const core::Status replied = node_.reply(request, answer(*asked));
        if (!replied.ok()) on_unsent_(replied);
      });
}

core::Status ParameterServices::offer() {
  PRESCENE_TRY(events_, node_.advertise(kParameterEventsTopic, "rcl_interfaces/msg/ParameterEvent",
                                        interfaces::TopicQos::kEvents));
  PRESCENE_RETURN_IF_ERROR(
      offer<interfaces::RosListParametersRequest>("list_parameters", "ListParameters", [this](const auto& asked) {
        return interfaces::RosListParametersResponse{table_.list(asked.prefixes, asked.depth)};
      }));
  PRESCENE_RETURN_IF_ERROR(offer<interfaces::RosGetParametersRequest>(
      "get_parameters", "GetParameters",
      [this](const auto& asked) { return interfaces::RosGetParametersResponse{table_.get(asked.names)}; }));
  PRESCENE_RETURN_IF_ERROR(offer<interfaces::RosGetParameterTypesRequest>(
      "get_parameter_types", "GetParameterTypes",
      [this](const auto& asked) { return interfaces::RosGetParameterTypesResponse{table_.types(asked.names)}; }));
  PRESCENE_RETURN_IF_ERROR(offer<interfaces::RosDescribeParametersRequest>(
      "describe_parameters", "DescribeParameters",
      [this](const auto& asked) { return interfaces::RosDescribeParametersResponse{table_.describe(asked.names)}; }));
  PRESCENE_RETURN_IF_ERROR(
      offer<interfaces::RosSetParametersRequest>("set_parameters", "SetParameters", [this](const auto& asked) {
        interfaces::RosSetParametersResponse response{table_.set(asked.parameters)};
        for (std::size_t i = 0; i < response.results.size(); ++i)
          if (response.results[i].successful) tell(asked.parameters[i]);
        return response;
      }));
  return offer<interfaces::RosSetParametersAtomicallyRequest>(
      "set_parameters_atomically", "SetParametersAtomically", [this](const auto& asked) {
        interfaces::RosSetParametersAtomicallyResponse response{table_.set_all(asked.parameters)};
        if (response.result.successful)
          for (const interfaces::RosParameter& one : asked.parameters) tell(one);
        return response;
      });
}

void ParameterServices::tell(const interfaces::RosParameter& set) {
  const std::optional<ParameterValue> value = table_.value(set.name);
  if (!value) return;
  core::log(log_, core::LogLevel::kInfo, "the parameter " + set.name + " is now " + text_of(*value));
  interfaces::RosParameterEvent event;
  event.stamp = interfaces::to_ros_time(core::wall_now_ns());
  event.node = node_name_;
  event.changed_parameters.push_back({set.name, to_ros_value(*value)});
  const core::Status sent = node_.publish(events_, event);
  if (!sent.ok()) on_unsent_(sent);
}

}  // namespace prescene::service
