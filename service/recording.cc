// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/service/outside_json.h"

namespace prescene::service {
namespace {

using nlohmann::ordered_json;

constexpr const char* kMetadataName = "prescene";
constexpr const char* kCrcKey = "crc32";
// Beyond the year 2116; the sum of two such times is in range.
constexpr core::TimeNs kLatestNs = std::numeric_limits<core::TimeNs>::max() / 2;
// A parsed document takes some twenty times its text.
constexpr std::size_t kMaxJsonBytes = std::size_t{8} << 20;

/// Of all values but that of the checksum itself, each with its key.
std::string crc_text(const std::map<std::string, std::string>& values) {
  std::uint32_t crc = 0;
  const auto add = [&crc](const std::string& text) {
    // With the final zero, so that no letter can move from one text to the next.
    crc = interfaces::crc32({reinterpret_cast<const std::uint8_t*>(text.c_str()), text.size() + 1}, crc);
  };
  for (const auto& [key, value] : values) {
    if (key == kCrcKey) continue;
    add(key);
    add(value);
  }
  return std::to_string(crc);
}

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
    if (found == json.end() || !found->is_number_unsigned()) return false;  // None of them is ever below 0.
    if (found->get<std::uint64_t>() > static_cast<std::uint64_t>(kLatestNs)) return false;
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
  interfaces::McapMetadata metadata{kMetadataName,
                                    {{"scene_file", info.scene_file},
                                     {"scene_text", info.scene_text},
                                     {"seed", std::to_string(info.seed)},
                                     {"settings", info.settings}}};
  metadata.values[kCrcKey] = crc_text(metadata.values);
  PRESCENE_RETURN_IF_ERROR(mcap->write_metadata(metadata));
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

core::Result<std::unique_ptr<RecordingReader>> RecordingReader::open(const std::filesystem::path& path,
                                                                     const RecordingReadOptions& options) {
  interfaces::McapReaderOptions mcap_options;
  mcap_options.salvage = options.salvage;
  mcap_options.check_data = options.check_data;
  PRESCENE_TRY(auto mcap, interfaces::McapReader::open(path, mcap_options));
  std::unique_ptr<RecordingReader> reader(new RecordingReader(std::move(mcap)));
  for (const interfaces::McapMetadata& metadata : reader->reader_->metadata()) {
    if (metadata.name != kMetadataName) continue;
    const auto crc = metadata.values.find(kCrcKey);
    if (crc != metadata.values.end() && crc->second != crc_text(metadata.values)) {
      if (!options.salvage) {
        return core::data_loss(path.string() +
                               ": the checksum of its scene, seed and settings is wrong; copy it again, or read what "
                               "is sound by `replay --salvage`");
      }
      reader->info_is_damaged_ = true;
      continue;
    }
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

std::string RecordingReader::loss_text() const {
  std::string text = reader_->loss().text();
  if (info_is_damaged_) text += std::string(text.empty() ? "" : "; ") + "its scene, seed and settings are damaged";
  return text;
}

core::Result<std::optional<RecordedEntry>> RecordingReader::next() {
  PRESCENE_TRY(std::optional<interfaces::McapMessage> message, reader_->next());
  if (!message) return std::optional<RecordedEntry>();
  const interfaces::McapChannel& channel = reader_->channels()[static_cast<std::size_t>(message->channel)];
  RecordedEntry entry;
  entry.message = {channel.topic, channel.schema.name, std::move(message->data), message->publish_time_ns,
                   message->log_time_ns};
  entry.is_json = channel.message_encoding == "json";
  if (std::max(entry.message.source_ns, entry.message.received_ns) > kLatestNs) {
    return core::data_loss("the recording has a message on " + entry.message.topic +
                           " from after the year 2116: its times are wrong");
  }
  if (entry.is_json && entry.message.cdr.size() > kMaxJsonBytes) {
    return core::resource_exhausted("the recording has a JSON document of " +
                                    interfaces::size_text(entry.message.cdr.size()) + " on " + entry.message.topic +
                                    "; up to " + interfaces::size_text(kMaxJsonBytes) + " are read");
  }
  if (!entry.is_json) entry.index = next_index_++;
  return std::optional<RecordedEntry>(std::move(entry));
}

}  // namespace prescene::service
