// SPDX-License-Identifier: Apache-2.0
// The parameters of the service's node, as `ros2 param` lists, describes, shows and sets them: a table without a bus.
//
//   ParameterTable table(std::move(parameters));
//   const auto results = table.set(request.parameters);   // each by itself; refused ones say why, and change nothing
//   ... table.value("history")
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "prescene/interfaces/ros_messages/parameter_messages.h"

namespace prescene::service {

using ParameterValue = std::variant<bool, std::int64_t, double, std::string, std::vector<double>>;

struct NodeParameter {
  std::string name;         ///< "question_seconds": that of the option that sets it at the start, with '_' for '-'.
  std::string description;  ///< A sentence for a person.
  ParameterValue value;     ///< At the start. Its type is the parameter's, for good.
  /// Has a new value take effect; null: the parameter can't be set. Called with the table's lock held.
  std::function<void(const ParameterValue& value)> apply = {};
  /// Least and greatest value of a number; both are allowed.
  std::optional<std::pair<double, double>> range = std::nullopt;
  std::vector<std::string> words = {};  ///< Those that a text may be; empty = any.
};

/// A request that names more than these gets an empty reply, as ROS's nodes give where a request can't be served.
inline constexpr std::size_t kMostNamesAsked = 1000;

/// Thread-safe.
class ParameterTable {
 public:
  /// No two may have one name. `after_set` is called, with the lock held, once after all of what is set together.
  explicit ParameterTable(std::vector<NodeParameter> parameters, std::function<void()> after_set = {});

  /// As ROS's nodes do it: names below the prefixes (all without any), down to `depth` of the parts that dots separate
  /// (0 = all); and the prefixes of what is listed.
  interfaces::RosListParametersResult list(std::span<const std::string> prefixes, std::uint64_t depth) const;
  /// One for each name, not set or nameless where there is no such parameter.
  std::vector<interfaces::RosParameterValue> get(std::span<const std::string> names) const;
  std::vector<std::uint8_t> types(std::span<const std::string> names) const;
  std::vector<interfaces::RosParameterDescriptor> describe(std::span<const std::string> names) const;
  /// Nothing where there is no such parameter.
  std::optional<ParameterValue> value(const std::string& name) const;

  /// Sets each that can be set, in order. An integer is taken for a number with a fraction, too: `ros2 param set` sends
  /// one for "30". A value of another type, one that is not in range, an unknown name and a parameter that can't be set
  /// are refused with the reason, naming what is allowed.
  std::vector<interfaces::RosSetParametersResult> set(std::span<const interfaces::RosParameter> asked);
  /// All, or none where one is refused.
  interfaces::RosSetParametersResult set_all(std::span<const interfaces::RosParameter> asked);

 private:
  struct Checked {
    ParameterValue value;
    std::string refusal;  ///< "" = it may be set.
  };
  const NodeParameter* find(const std::string& name) const;
  Checked check(const interfaces::RosParameter& asked) const;
  void put(const std::string& name, ParameterValue value);

  mutable std::mutex mutex_;  // guards all below
  std::map<std::string, NodeParameter> parameters_;
  std::function<void()> after_set_;
};

/// As it is on the wire.
interfaces::RosParameterValue to_ros_value(const ParameterValue& value);

}  // namespace prescene::service
