// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/node_parameters.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "prescene/core/check.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::service {
namespace {

using interfaces::RosParameter;
using interfaces::RosParameterType;
using interfaces::RosSetParametersResult;

std::string words_of(std::uint8_t type) {
  constexpr std::array<const char*, 10> kWords = {"nothing",      "bool",        "integer",    "double",
                                                  "string",       "byte array",  "bool array", "integer array",
                                                  "double array", "string array"};
  return type < kWords.size() ? kWords[type] : "type " + std::to_string(type);
}

std::uint8_t type_of(const ParameterValue& value) { return to_ros_value(value).type; }

/// The value as one of the type of `like`; nothing where it is of another.
std::optional<ParameterValue> read_value(const interfaces::RosParameterValue& value, const ParameterValue& like) {
  const auto type = static_cast<RosParameterType>(value.type);
  if (type == RosParameterType::kInteger && std::holds_alternative<double>(like))
    return static_cast<double>(value.integer_value);
  if (value.type != type_of(like)) return std::nullopt;
  switch (type) {
    case RosParameterType::kBool:
      return value.bool_value;
    case RosParameterType::kInteger:
      return value.integer_value;
    case RosParameterType::kDouble:
      return value.double_value;
    case RosParameterType::kString:
      return value.string_value;
    case RosParameterType::kDoubleArray:
      return value.double_array_value;
    default:
      return std::nullopt;
  }
}

std::string word_list(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string range_text(const std::pair<double, double>& range) {
  return interfaces::number_text(range.first) + " to " + interfaces::number_text(range.second);
}

}  // namespace

interfaces::RosParameterValue to_ros_value(const ParameterValue& value) {
  interfaces::RosParameterValue ros;
  const auto set = [&ros](RosParameterType type, auto& field, const auto& content) {
    ros.type = static_cast<std::uint8_t>(type);
    field = content;
  };
  if (const auto* truth = std::get_if<bool>(&value)) set(RosParameterType::kBool, ros.bool_value, *truth);
  if (const auto* whole = std::get_if<std::int64_t>(&value)) set(RosParameterType::kInteger, ros.integer_value, *whole);
  if (const auto* number = std::get_if<double>(&value)) set(RosParameterType::kDouble, ros.double_value, *number);
  if (const auto* text = std::get_if<std::string>(&value)) set(RosParameterType::kString, ros.string_value, *text);
  if (const auto* row = std::get_if<std::vector<double>>(&value))
    set(RosParameterType::kDoubleArray, ros.double_array_value, *row);
  return ros;
}

ParameterTable::ParameterTable(std::vector<NodeParameter> parameters, std::function<void()> after_set)
    : after_set_(std::move(after_set)) {
  for (NodeParameter& parameter : parameters) {
    const std::string name = parameter.name;
    PRESCENE_CHECK_MSG(parameters_.emplace(name, std::move(parameter)).second, name);
  }
}

const NodeParameter* ParameterTable::find(const std::string& name) const {
  const auto found = parameters_.find(name);
  return found == parameters_.end() ? nullptr : &found->second;
}

interfaces::RosListParametersResult ParameterTable::list(std::span<const std::string> prefixes,
                                                         std::uint64_t depth) const {
  const auto is_near = [depth](std::string_view below) {
    return depth == 0 || static_cast<std::uint64_t>(std::count(below.begin(), below.end(), '.')) < depth;
  };
  const auto is_asked = [&](const std::string& name) {
    if (prefixes.empty()) return is_near(name);
    return std::any_of(prefixes.begin(), prefixes.end(), [&](const std::string& prefix) {
      if (name == prefix) return true;
      return name.starts_with(prefix + ".") && is_near(std::string_view(name).substr(prefix.size() + 1));
    });
  };
  interfaces::RosListParametersResult result;
  if (prefixes.size() > kMostNamesAsked) return result;
  const std::lock_guard lock(mutex_);
  for (const auto& [name, parameter] : parameters_) {
    if (!is_asked(name)) continue;
    result.names.push_back(name);
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos) continue;
    const std::string prefix = name.substr(0, dot);
    if (std::find(result.prefixes.begin(), result.prefixes.end(), prefix) == result.prefixes.end())
      result.prefixes.push_back(prefix);
  }
  return result;
}

std::vector<interfaces::RosParameterValue> ParameterTable::get(std::span<const std::string> names) const {
  std::vector<interfaces::RosParameterValue> values;
  if (names.size() > kMostNamesAsked) return values;
  const std::lock_guard lock(mutex_);
  for (const std::string& name : names) {
    const NodeParameter* parameter = find(name);
    values.push_back(parameter == nullptr ? interfaces::RosParameterValue{} : to_ros_value(parameter->value));
  }
  return values;
}

std::vector<std::uint8_t> ParameterTable::types(std::span<const std::string> names) const {
  std::vector<std::uint8_t> types;
  for (const interfaces::RosParameterValue& value : get(names)) types.push_back(value.type);
  return types;
}

std::vector<interfaces::RosParameterDescriptor> ParameterTable::describe(std::span<const std::string> names) const {
  std::vector<interfaces::RosParameterDescriptor> descriptors;
  if (names.size() > kMostNamesAsked) return descriptors;
  const std::lock_guard lock(mutex_);
  for (const std::string& name : names) {
    interfaces::RosParameterDescriptor& descriptor = descriptors.emplace_back();
    const NodeParameter* parameter = find(name);
    if (core::is_utf8(name)) descriptor.name = name;  // nodes in Python could not read another
    if (parameter == nullptr) continue;
    descriptor.type = type_of(parameter->value);
    descriptor.description = parameter->description;
    descriptor.read_only = !parameter->apply;
    if (!parameter->words.empty()) descriptor.additional_constraints = "one of " + word_list(parameter->words);
    if (parameter->range && std::holds_alternative<double>(parameter->value))
      descriptor.floating_point_range.push_back({parameter->range->first, parameter->range->second, 0.0});
    if (parameter->range && std::holds_alternative<std::int64_t>(parameter->value))
      descriptor.integer_range.push_back(
          {static_cast<std::int64_t>(parameter->range->first), static_cast<std::int64_t>(parameter->range->second), 0});
  }
  return descriptors;
}

std::optional<ParameterValue> ParameterTable::value(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const NodeParameter* parameter = find(name);
  return parameter == nullptr ? std::nullopt : std::optional(parameter->value);
}

ParameterTable::Checked ParameterTable::check(const RosParameter& asked) const {
  const std::string name = interfaces::quote(asked.name);
  const NodeParameter* parameter = find(asked.name);
  if (parameter == nullptr)
    return {{}, "there is no parameter " + name + ": `ros2 param list` shows those that there are"};
  if (!parameter->apply)
    return {{}, name + " is set at the start and stays as it is: restart the service to change it"};
  std::optional<ParameterValue> value = read_value(asked.value, parameter->value);
  if (!value)
    return {{},
            name + " is of type " + words_of(type_of(parameter->value)) + ", and the value that was given is of type " +
                words_of(asked.value.type)};
  std::optional<double> number;
  if (const auto* real = std::get_if<double>(&*value)) number = *real;
  if (const auto* whole = std::get_if<std::int64_t>(&*value)) number = static_cast<double>(*whole);
  if (number && parameter->range && !(*number >= parameter->range->first && *number <= parameter->range->second))
    return {{}, name + " may be " + range_text(*parameter->range) + ", not " + interfaces::number_text(*number)};
  const auto* text = std::get_if<std::string>(&*value);
  if (text != nullptr && !parameter->words.empty() &&
      std::find(parameter->words.begin(), parameter->words.end(), *text) == parameter->words.end())
    return {{}, name + " is one of " + word_list(parameter->words) + ", not " + interfaces::quote(*text)};
  return {*std::move(value), ""};
}

void ParameterTable::put(const std::string& name, ParameterValue value) {
  NodeParameter& parameter = parameters_.at(name);
  parameter.apply(value);
  parameter.value = std::move(value);
}

std::vector<RosSetParametersResult> ParameterTable::set(std::span<const RosParameter> asked) {
  std::vector<RosSetParametersResult> results;
  if (asked.size() > kMostNamesAsked) return results;
  const std::lock_guard lock(mutex_);
  for (const RosParameter& one : asked) {
    Checked checked = check(one);
    results.push_back({checked.refusal.empty(), checked.refusal});
    if (!checked.refusal.empty()) continue;
    put(one.name, std::move(checked.value));
    if (after_set_) after_set_();
  }
  return results;
}

RosSetParametersResult ParameterTable::set_all(std::span<const RosParameter> asked) {
  if (asked.size() > kMostNamesAsked)
    return {false, "more than " + std::to_string(kMostNamesAsked) + " parameters at once: set fewer"};
  const std::lock_guard lock(mutex_);
  std::vector<ParameterValue> values;
  for (const RosParameter& one : asked) {
    Checked checked = check(one);
    if (!checked.refusal.empty()) return {false, std::move(checked.refusal)};
    values.push_back(std::move(checked.value));
  }
  for (std::size_t i = 0; i < asked.size(); ++i) put(asked[i].name, std::move(values[i]));
  if (after_set_) after_set_();
  return {true, ""};
}

}  // namespace prescene::service
