// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/tracker_settings.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "prescene/belief/json.h"
#include "prescene/service/outside_json.h"

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

core::Status read_value(const ordered_json& json, const std::string& key, std::optional<bool>& value) {
  if (!json.is_null() && !json.is_boolean()) return wrong(key, "true, false or null");
  value = json.is_null() ? std::nullopt : std::optional(json.get<bool>());
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

ordered_json value_json(const std::optional<geometry::Pose>& pose) {
  return pose ? belief::to_json(*pose) : ordered_json();
}
ordered_json value_json(const std::optional<bool>& value) { return value ? ordered_json(*value) : ordered_json(); }
template <class Value>
ordered_json value_json(const Value& value) {
  return value;
}

/// Calls visit(key, value) for each setting that recordings hold; `settings` may be const.
template <class Settings, class Visit>
void for_each_setting(Settings& settings, const Visit& visit) {
  visit("depth_topic", settings.topics.depth);
  visit("color_topic", settings.topics.color);
  visit("depth_form", settings.topics.depth_form);
  visit("color_form", settings.topics.color_form);
  visit("camera_info_topic", settings.topics.camera_info);
  visit("tf_topic", settings.topics.tf);
  visit("tf_static_topic", settings.topics.tf_static);
  visit("joint_states_topic", settings.topics.joint_states);
  visit("clock_topic", settings.topics.clock);
  visit("world_frame", settings.assembler.world_frame);
  visit("camera_frame", settings.assembler.camera_frame);
  visit("X_WC", settings.assembler.X_WC);
  visit("max_wait_s", settings.assembler.max_wait_s);
  visit("max_stamp_difference_s", settings.assembler.max_stamp_difference_s);
  visit("use_color", settings.assembler.use_color);
  visit("rectified", settings.assembler.rectified);
  visit("mono16_is_depth", settings.assembler.mono16_is_depth);
  visit("tf_history_s", settings.tf.history_s);
  visit("tf_max_frames", settings.tf.max_frames);
  visit("tf_max_samples", settings.tf.max_samples);
  visit("tf_max_extrapolation_s", settings.tf.max_extrapolation_s);
  visit("learned", settings.learned);
  visit("learned_file", settings.learned_file);
  visit("new_objects", settings.new_objects);
}

}  // namespace

bool is_rectified(const TrackerSettings& settings) {
  return settings.assembler.rectified.value_or(names_rectified_images(settings.topics.depth));
}

std::string rectified_doubt(const TrackerSettings& settings) {
  return rectified_doubt(settings.topics, settings.assembler);
}

std::string rectified_doubt(const InputTopics& topics, const AssemblerSettings& assembler) {
  const bool uses_color = assembler.use_color && !topics.color.empty();
  if (assembler.rectified || !uses_color ||
      names_rectified_images(topics.depth) == names_rectified_images(topics.color))
    return "";
  return "by their names, one of " + topics.depth + " and " + topics.color +
         " holds rectified images and the other does not: name two of a kind, or say with --rectified or "
         "--not-rectified what both hold";
}

ordered_json to_json(const TrackerSettings& settings) {
  ordered_json json = ordered_json::object();
  for_each_setting(settings, [&](const char* key, const auto& value) { json[key] = value_json(value); });
  return json;
}

core::Result<TrackerSettings> with_recorded(TrackerSettings settings, const ordered_json& json) {
  if (!json.is_object()) return core::invalid_input("an object is needed");
  core::Status first_bad;
  for_each_setting(settings, [&](const char* key, auto& value) {
    const auto found = json.find(key);
    if (found != json.end() && first_bad.ok()) first_bad = read_value(*found, key, value);
  });
  PRESCENE_RETURN_IF_ERROR(first_bad);
  return settings;
}

std::string running_settings_text(const TrackerSettings& settings) {
  return belief::json_text({{"max_wait_s", settings.assembler.max_wait_s},
                            {"max_stamp_difference_s", settings.assembler.max_stamp_difference_s},
                            {"new_objects", value_json(settings.new_objects)}});
}

core::Result<TrackerSettings> with_running(const TrackerSettings& settings, const std::string& text) {
  constexpr std::size_t kLongest = 4096;
  PRESCENE_TRY(const TrackerSettings read, with_recorded(settings, parse_or_discard(text, kLongest)));
  TrackerSettings running = settings;
  running.assembler.max_wait_s = read.assembler.max_wait_s;
  running.assembler.max_stamp_difference_s = read.assembler.max_stamp_difference_s;
  running.new_objects = read.new_objects;
  return running;
}

}  // namespace prescene::service
