// SPDX-License-Identifier: Apache-2.0
// The ROS 2 messages about parameters of nodes (package rcl_interfaces), as plain structs with the fields of their .msg
// and .srv files in wire order, as in messages.h.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "prescene/interfaces/ros_messages/messages.h"

namespace prescene::interfaces {

/// rcl_interfaces/ParameterType: which field of a value counts.
enum class RosParameterType : std::uint8_t {
  kNotSet = 0,
  kBool = 1,
  kInteger = 2,
  kDouble = 3,
  kString = 4,
  kByteArray = 5,
  kBoolArray = 6,
  kIntegerArray = 7,
  kDoubleArray = 8,
  kStringArray = 9,
};

/// rcl_interfaces/ParameterValue.
struct RosParameterValue {
  std::uint8_t type = 0;  ///< A RosParameterType, or nonsense.
  bool bool_value = false;
  std::int64_t integer_value = 0;
  double double_value = 0.0;
  std::string string_value;
  std::vector<std::uint8_t> byte_array_value;
  std::vector<std::uint8_t> bool_array_value;  ///< 0 is false.
  std::vector<std::int64_t> integer_array_value;
  std::vector<double> double_array_value;
  std::vector<std::string> string_array_value;
  friend bool operator==(const RosParameterValue&, const RosParameterValue&) = default;
};

/// rcl_interfaces/Parameter.
struct RosParameter {
  std::string name;
  RosParameterValue value;
  friend bool operator==(const RosParameter&, const RosParameter&) = default;
};

/// rcl_interfaces/FloatingPointRange: both ends are allowed; a step of 0 is none.
struct RosFloatingPointRange {
  double from_value = 0.0;
  double to_value = 0.0;
  double step = 0.0;
  friend bool operator==(const RosFloatingPointRange&, const RosFloatingPointRange&) = default;
};

/// rcl_interfaces/IntegerRange, likewise.
struct RosIntegerRange {
  std::int64_t from_value = 0;
  std::int64_t to_value = 0;
  std::uint64_t step = 0;
  friend bool operator==(const RosIntegerRange&, const RosIntegerRange&) = default;
};

/// rcl_interfaces/ParameterDescriptor.
struct RosParameterDescriptor {
  std::string name;
  std::uint8_t type = 0;  ///< As in RosParameterValue.
  std::string description;
  std::string additional_constraints;
  bool read_only = false;
  bool dynamic_typing = false;
  std::vector<RosFloatingPointRange> floating_point_range;  ///< One at most.
  std::vector<RosIntegerRange> integer_range;               ///< The same.
  friend bool operator==(const RosParameterDescriptor&, const RosParameterDescriptor&) = default;
};

/// rcl_interfaces/SetParametersResult.
struct RosSetParametersResult {
  bool successful = false;
  std::string reason;  ///< Why not.
  friend bool operator==(const RosSetParametersResult&, const RosSetParametersResult&) = default;
};

/// rcl_interfaces/ListParametersResult.
struct RosListParametersResult {
  std::vector<std::string> names;
  std::vector<std::string> prefixes;
  friend bool operator==(const RosListParametersResult&, const RosListParametersResult&) = default;
};

/// rcl_interfaces/ParameterEvent, on /parameter_events.
struct RosParameterEvent {
  RosTime stamp;
  std::string node;  ///< "/prescene"
  std::vector<RosParameter> new_parameters;
  std::vector<RosParameter> changed_parameters;
  std::vector<RosParameter> deleted_parameters;
  friend bool operator==(const RosParameterEvent&, const RosParameterEvent&) = default;
};

// The services /NODE/list_parameters, get_parameters, get_parameter_types, describe_parameters, set_parameters and
// set_parameters_atomically: their requests and replies.

struct RosListParametersRequest {
  std::vector<std::string> prefixes;
  std::uint64_t depth = 0;  ///< 0 = all.
  friend bool operator==(const RosListParametersRequest&, const RosListParametersRequest&) = default;
};
struct RosListParametersResponse {
  RosListParametersResult result;
  friend bool operator==(const RosListParametersResponse&, const RosListParametersResponse&) = default;
};

struct RosGetParametersRequest {
  std::vector<std::string> names;
  friend bool operator==(const RosGetParametersRequest&, const RosGetParametersRequest&) = default;
};
struct RosGetParametersResponse {
  std::vector<RosParameterValue> values;
  friend bool operator==(const RosGetParametersResponse&, const RosGetParametersResponse&) = default;
};

struct RosGetParameterTypesRequest {
  std::vector<std::string> names;
  friend bool operator==(const RosGetParameterTypesRequest&, const RosGetParameterTypesRequest&) = default;
};
struct RosGetParameterTypesResponse {
  std::vector<std::uint8_t> types;
  friend bool operator==(const RosGetParameterTypesResponse&, const RosGetParameterTypesResponse&) = default;
};

struct RosDescribeParametersRequest {
  std::vector<std::string> names;
  friend bool operator==(const RosDescribeParametersRequest&, const RosDescribeParametersRequest&) = default;
};
struct RosDescribeParametersResponse {
  std::vector<RosParameterDescriptor> descriptors;
  friend bool operator==(const RosDescribeParametersResponse&, const RosDescribeParametersResponse&) = default;
};

struct RosSetParametersRequest {
  std::vector<RosParameter> parameters;
  friend bool operator==(const RosSetParametersRequest&, const RosSetParametersRequest&) = default;
};
struct RosSetParametersResponse {
  std::vector<RosSetParametersResult> results;
  friend bool operator==(const RosSetParametersResponse&, const RosSetParametersResponse&) = default;
};

struct RosSetParametersAtomicallyRequest {
  std::vector<RosParameter> parameters;
  friend bool operator==(const RosSetParametersAtomicallyRequest&, const RosSetParametersAtomicallyRequest&) = default;
};
struct RosSetParametersAtomicallyResponse {
  RosSetParametersResult result;
  friend bool operator==(const RosSetParametersAtomicallyResponse&,
                         const RosSetParametersAtomicallyResponse&) = default;
};

}  // namespace prescene::interfaces
