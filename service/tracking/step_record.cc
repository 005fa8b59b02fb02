// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/step_record.h"

#include <nlohmann/json.hpp>
#include <type_traits>

#include "prescene/service/outside_json.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

/// Of the key's value, if it is a whole number from 0 to kLatestRecordedNs: none in a step record is another.
std::optional<std::uint64_t> number_at(const ordered_json& json, const char* key) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number_unsigned()) return std::nullopt;
  const auto value = found->get<std::uint64_t>();
  return value <= static_cast<std::uint64_t>(kLatestRecordedNs) ? std::optional(value) : std::nullopt;
}

/// False where there is a list of another form.
bool read_skipped(const ordered_json& json, std::vector<SkippedFrame>& skipped) {
  const auto list = json.find("skipped");
  if (list == json.end()) return true;
  if (!list->is_array()) return false;
  for (const ordered_json& frame : *list) {
    if (!frame.is_object()) return false;
    const auto depth = number_at(frame, "depth");
    const auto stamp_ns = number_at(frame, "stamp_ns");
    const auto reason = frame.find("reason");
    if (!depth || !stamp_ns || reason == frame.end() || !reason->is_string()) return false;
    skipped.push_back({*depth, static_cast<core::TimeNs>(*stamp_ns), reason->get<std::string>()});
  }
  return true;
}

bool read_degraded(const ordered_json& json, std::vector<std::string>& degraded) {
  const auto list = json.find("degraded");
  if (list == json.end()) return true;
  if (!list->is_array()) return false;
  for (const ordered_json& word : *list) {
    if (!word.is_string()) return false;
    degraded.push_back(word.get<std::string>());
  }
  return true;
}

}  // namespace

ordered_json to_json(const StepRecord& record) {
  ordered_json skipped = ordered_json::array();
  for (const SkippedFrame& frame : record.skipped) {
    skipped.push_back({{"depth", frame.depth}, {"stamp_ns", frame.stamp_ns}, {"reason", frame.reason}});
  }
  ordered_json json = {{"step", record.step},
                       {"after", record.after},
                       {"now_ns", record.now_ns},
                       {"stamp_ns", record.stamp_ns},
                       {"depth", record.depth}};
  if (record.camera != 0) json["camera"] = record.camera;
  if (record.color) json["color"] = *record.color;
  json["camera_info"] = record.camera_info;
  json["tf_until"] = record.tf_until;
  json["skipped"] = skipped;
  json["degraded"] = record.degraded;
  json["belief_hash"] = record.belief_hash;
  json["seconds"] = record.seconds;
  return json;
}

core::Result<StepRecord> step_record_from_json(const std::string& text) {
  const ordered_json json = parse_or_discard(text, kMostParsedJsonBytes);
  const auto bad = [](const std::string& what) {
    return core::invalid_input("step record: " + what + ": the recording was made by another version or is damaged");
  };
  if (!json.is_object()) return bad("not a JSON object");
  StepRecord record;
  const auto number = [&json](const char* key, auto& value) {
    const auto found = number_at(json, key);
    if (found) value = static_cast<std::remove_reference_t<decltype(value)>>(*found);
    return found.has_value();
  };
  if (!number("step", record.step)) return bad("no 'step'");
  if (!number("after", record.after)) return bad("no 'after'");
  if (!number("now_ns", record.now_ns)) return bad("no 'now_ns'");
  if (!number("stamp_ns", record.stamp_ns)) return bad("no 'stamp_ns'");
  if (!number("depth", record.depth)) return bad("no 'depth'");
  if (!number("camera_info", record.camera_info)) return bad("no 'camera_info'");
  if (!number("tf_until", record.tf_until)) return bad("no 'tf_until'");
  if (json.contains("camera") && (!number("camera", record.camera) || record.camera < 0))
    return bad("'camera' is not a number");
  if (json.contains("color") && !number("color", record.color.emplace())) return bad("'color' is not a number");
  const auto hash = json.find("belief_hash");
  if (hash == json.end() || !hash->is_string()) return bad("no 'belief_hash'");
  record.belief_hash = hash->get<std::string>();
  if (!read_skipped(json, record.skipped)) return bad("'skipped' is not a list of frames");
  if (!read_degraded(json, record.degraded)) return bad("'degraded' is not a list of texts");
  if (const auto seconds = json.find("seconds"); seconds != json.end()) {
    if (!seconds->is_number()) return bad("'seconds' is not a number");
    record.seconds = seconds->get<double>();
  }
  return record;
}

}  // namespace prescene::service
