// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

constexpr const char* kMetadataName = "prescene";

interfaces::McapChannel json_channel(const std::string& topic) {
  return {
      topic, "json", {"prescene" + topic.substr(topic.find_last_of('/')), "jsonschema", R"({"type": "object"})"}, {}};
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
  const ordered_json json = parse_or_discard(text);
  const auto bad = [](const std::string& what) {
    return core::invalid_input("step record: " + what + ": the recording was made by another version or is damaged");
  };
  if (!json.is_object()) return bad("not a JSON object");
  StepRecord record;
  const auto number = [&json](const char* key, auto& value) {
    const auto found = json.find(key);
    if (found == json.end() || !found->is_number_integer()) return false;
    value = found->get<std::remove_reference_t<decltype(value)>>();
    return true;
  };
  if (!number("step", record.step)) return bad("no 'step'");
  if (!number("after", record.after)) return bad("no 'after'");
  if (!number("now_ns", record.now_ns)) return bad("no 'now_ns'");
  if (!number("stamp_ns", record.stamp_ns)) return bad("no 'stamp_ns'");
  if (!number("depth", record.depth)) return bad("no 'depth'");
  if (!number("camera_info", record.camera_info)) return bad("no 'camera_info'");
  if (!number("tf_until", record.tf_until)) return bad("no 'tf_until'");
  MessageIndex color = 0;
  if (number("color", color)) record.color = color;
  const auto hash = json.find("belief_hash");
  if (hash == json.end() || !hash->is_string()) return bad("no 'belief_hash'");
  record.belief_hash = hash->get<std::string>();
  return record;
}

std::filesystem::path unused_recording_path(const std::filesystem::path& path) {
  std::filesystem::path unused = path;
  std::error_code none;
  for (int i = 2; std::filesystem::is_regular_file(unused, none); ++i) {
    unused = path;
    unused.replace_filename(path.stem().string() + "-" + std::to_string(i) + path.extension().string());
  }
  return unused;
}

core::Result<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const std::filesystem::path& path,
                                                                       const RecordingInfo& info) {
  PRESCENE_TRY(auto mcap, interfaces::McapWriter::create(path, {}));
  PRESCENE_RETURN_IF_ERROR(mcap->write_metadata({kMetadataName,
                                                 {{"scene_file", info.scene_file},
                                                  {"scene_text", info.scene_text},
                                                  {"seed", std::to_string(info.seed)},
                                                  {"settings", info.settings}}}));
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(std::move(mcap)));
}

core::Status RecordingWriter::write(const std::string& topic, const interfaces::McapChannel& channel,
                                    core::TimeNs log_ns, core::TimeNs publish_ns, std::vector<std::uint8_t> data) {
  auto found = channels_.find(topic);
  if (found == channels_.end()) {
    PRESCENE_TRY(const int number, writer_->add_channel(channel));
    found = channels_.emplace(topic, number).first;
  }
  return writer_->write({found->second, sequences_[topic]++, log_ns, publish_ns, std::move(data)});
}

core::Result<MessageIndex> RecordingWriter::write(const interfaces::ReceivedMessage& message) {
  PRESCENE_RETURN_IF_ERROR(write(message.topic, interfaces::ros_channel(message.topic, message.type),
                                 message.received_ns, message.source_ns, message.cdr));
  return next_index_++;
}

core::Status RecordingWriter::write_json(const std::string& topic, const std::string& json, core::TimeNs time_ns) {
  return write(topic, json_channel(topic), time_ns, time_ns, {json.begin(), json.end()});
}

core::Result<std::unique_ptr<RecordingReader>> RecordingReader::open(const std::filesystem::path& path) {
  PRESCENE_TRY(auto mcap, interfaces::McapReader::open(path));
  std::unique_ptr<RecordingReader> reader(new RecordingReader(std::move(mcap)));
  for (const interfaces::McapMetadata& metadata : reader->reader_->metadata()) {
    if (metadata.name != kMetadataName) continue;
    const auto value = [&metadata](const char* key) {
      const auto found = metadata.values.find(key);
      return found == metadata.values.end() ? std::string() : found->second;
    };
    reader->info_.scene_file = value("scene_file");
    reader->info_.scene_text = value("scene_text");
    reader->info_.settings = value("settings");
    reader->info_.seed = std::strtoull(value("seed").c_str(), nullptr, 10);
  }
  return reader;
}

core::Result<std::optional<RecordedEntry>> RecordingReader::next() {
  PRESCENE_TRY(std::optional<interfaces::McapMessage> message, reader_->next());
  if (!message) return std::optional<RecordedEntry>();
  const interfaces::McapChannel& channel = reader_->channels()[static_cast<std::size_t>(message->channel)];
  RecordedEntry entry;
  entry.message = {channel.topic, channel.schema.name, std::move(message->data), message->publish_time_ns,
                   message->log_time_ns};
  entry.is_json = channel.message_encoding == "json";
  if (!entry.is_json) entry.index = next_index_++;
  return std::optional<RecordedEntry>(std::move(entry));
}

}  // namespace prescene::service
