// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracker_settings.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "prescene/belief/json.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

core::Status wrong(const std::string& key, const std::string& needed) {
  return core::invalid_input(key + ": " + needed + " is needed");
}

core::Status read_value(const ordered_json& json, const std::string& key, std::string& value) {
  if (!json.is_string()) return wrong(key, "a text");
  value = json.get<std::string>();
  return core::ok_status();
}

core::Status read_value(const ordered_json& json, const std::string& key, bool& value) {
  if (!json.is_boolean()) return wrong(key, "true or false");
  value = json.get<bool>();
  return core::ok_status();
}

core::Status read_value(const ordered_json& json, const std::string& key, double& value) {
  if (!json.is_number() || !std::isfinite(json.get<double>()) || json.get<double>() < 0.0)
    return wrong(key, "a number of 0 or more");
  value = json.get<double>();
  return core::ok_status();
}

core::Status read_value(const ordered_json& json, const std::string& key, int& value) {
  if (!json.is_number_integer() || json.get<std::int64_t>() < 1 || json.get<std::int64_t>() > 1'000'000)
    return wrong(key, "a whole number of 1 to 1000000");
  value = json.get<int>();
  return core::ok_status();
}

core::Status read_value(const ordered_json& json, const std::string& key, std::optional<geometry::Pose>& value) {
  value.reset();
  if (json.is_null()) return core::ok_status();
  auto pose = belief::pose_from_json(json);
  if (!pose) return pose.status().at(key);
  value = *pose;
  return core::ok_status();
}

/// Reads `key` of an object where it is there.
template <class Value>
core::Status read(const ordered_json& json, const char* key, Value& value) {
  const auto found = json.find(key);
  return found == json.end() ? core::ok_status() : read_value(*found, key, value);
}

}  // namespace

ordered_json to_json(const TrackerSettings& settings) {
  const AssemblerSettings& assembler = settings.assembler;
  return {{"depth_topic", settings.topics.depth},
          {"color_topic", settings.topics.color},
          {"camera_info_topic", settings.topics.camera_info},
          {"tf_topic", settings.topics.tf},
          {"tf_static_topic", settings.topics.tf_static},
          {"world_frame", assembler.world_frame},
          {"camera_frame", assembler.camera_frame},
          {"X_WC", assembler.X_WC ? belief::to_json(*assembler.X_WC) : ordered_json()},
          {"max_wait_s", assembler.max_wait_s},
          {"max_stamp_difference_s", assembler.max_stamp_difference_s},
          {"use_color", assembler.use_color},
          {"rectified", assembler.rectified},
          {"mono16_is_depth", assembler.mono16_is_depth},
          {"tf_history_s", settings.tf.history_s},
          {"tf_max_frames", settings.tf.max_frames},
          {"tf_max_extrapolation_s", settings.tf.max_extrapolation_s}};
}

core::Result<TrackerSettings> with_recorded(TrackerSettings settings, const ordered_json& json) {
  if (!json.is_object()) return core::invalid_input("an object is needed");
  AssemblerSettings& assembler = settings.assembler;
  PRESCENE_RETURN_IF_ERROR(read(json, "depth_topic", settings.topics.depth));
  PRESCENE_RETURN_IF_ERROR(read(json, "color_topic", settings.topics.color));
  PRESCENE_RETURN_IF_ERROR(read(json, "camera_info_topic", settings.topics.camera_info));
  PRESCENE_RETURN_IF_ERROR(read(json, "tf_topic", settings.topics.tf));
  PRESCENE_RETURN_IF_ERROR(read(json, "tf_static_topic", settings.topics.tf_static));
  PRESCENE_RETURN_IF_ERROR(read(json, "world_frame", assembler.world_frame));
  PRESCENE_RETURN_IF_ERROR(read(json, "camera_frame", assembler.camera_frame));
  PRESCENE_RETURN_IF_ERROR(read(json, "X_WC", assembler.X_WC));
  PRESCENE_RETURN_IF_ERROR(read(json, "max_wait_s", assembler.max_wait_s));
  PRESCENE_RETURN_IF_ERROR(read(json, "max_stamp_difference_s", assembler.max_stamp_difference_s));
  PRESCENE_RETURN_IF_ERROR(read(json, "use_color", assembler.use_color));
  PRESCENE_RETURN_IF_ERROR(read(json, "rectified", assembler.rectified));
  PRESCENE_RETURN_IF_ERROR(read(json, "mono16_is_depth", assembler.mono16_is_depth));
  PRESCENE_RETURN_IF_ERROR(read(json, "tf_history_s", settings.tf.history_s));
  PRESCENE_RETURN_IF_ERROR(read(json, "tf_max_frames", settings.tf.max_frames));
  PRESCENE_RETURN_IF_ERROR(read(json, "tf_max_extrapolation_s", settings.tf.max_extrapolation_s));
  return settings;
}

}  // namespace prescene::service
