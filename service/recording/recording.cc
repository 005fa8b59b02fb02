// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/recording.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "recording_format.h"

namespace prescene::service {
namespace {

constexpr const char* kStringType = "std_msgs/msg/String";

std::string media_type_of(const std::string& name) {
  const std::string extension = std::filesystem::path(name).extension().string();
  if (extension == ".yaml" || extension == ".yml") return "application/yaml";
  return extension.empty() ? "application/octet-stream" : "model/" + extension.substr(1);
}

}  // namespace

bool holds_own_json(const interfaces::McapChannel& channel) { return kind_of(channel) == kJsonKind; }

bool is_own_output(const interfaces::McapChannel& channel) { return kind_of(channel) == kOutputKind; }

bool is_repeated(const interfaces::McapChannel& channel) { return kind_of(channel) == kAgainKind; }

core::Result<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const std::filesystem::path& path,
                                                                       const RecordingInfo& info,
                                                                       const RecordingSafety& safety) {
  PRESCENE_TRY(auto recording, open(path, safety));
  PRESCENE_RETURN_IF_ERROR(recording->begin(info));
  PRESCENE_RETURN_IF_ERROR(recording->attach(info));
  return recording;
}

core::Result<std::unique_ptr<RecordingWriter>> RecordingWriter::make_ready(const std::filesystem::path& path,
                                                                           const RecordingInfo& info,
                                                                           const RecordingSafety& safety) {
  PRESCENE_TRY(auto recording, open(path, safety));
  PRESCENE_RETURN_IF_ERROR(recording->attach(info));
  return recording;
}

core::Result<std::unique_ptr<RecordingWriter>> RecordingWriter::open(const std::filesystem::path& path,
                                                                     const RecordingSafety& safety) {
  interfaces::McapWriterOptions options;
  options.chunk_ns = core::ns_of(safety.kept_back_s);
  options.sync_interval = std::chrono::milliseconds(std::llround(1e3 * safety.unsynced_s));
  PRESCENE_TRY(auto mcap, interfaces::McapWriter::create(path, options));
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(std::move(mcap)));
}

core::Status RecordingWriter::begin(const RecordingInfo& info) {
  interfaces::McapMetadata metadata{kMetadataName,
                                    {{"scene_file", info.scene_file},
                                     {"scene_text", info.scene_text},
                                     {"seed", std::to_string(info.seed)},
                                     {"settings", info.settings},
                                     {kNumberedKey, kNumbered}}};
  if (info.files) metadata.values[kAttachedKey] = std::to_string(info.files->size());
  if (!info.part.series.empty()) {
    metadata.values[kSeriesKey] = info.part.series;
    metadata.values["part"] = std::to_string(info.part.number);
    metadata.values["first_message"] = std::to_string(info.part.first_message);
    metadata.values["began_ns"] = std::to_string(info.part.began_ns);
    metadata.values["after_gap"] = info.part.after_gap ? "yes" : "no";
    if (!info.part.bounded_as.empty()) {
      metadata.values["bounded_as"] = info.part.bounded_as;
      metadata.values["first_file"] = info.part.first_file;
    }
  }
  metadata.values[kCrcKey] = crc_text(metadata.values);
  next_index_ = info.part.first_message;
  tf_static_ = info.tf_static;
  return writer_->write_metadata(metadata);
}

core::Status RecordingWriter::attach(const RecordingInfo& info) {
  if (!info.scene_text.empty()) {
    // For people: the text in the metadata is what is replayed.
    const std::string name = std::filesystem::path(info.scene_file).filename().string();
    PRESCENE_RETURN_IF_ERROR(writer_->write_attachment(
        {name.empty() ? "scene.yaml" : name, "application/yaml", {info.scene_text.begin(), info.scene_text.end()}}));
  }
  if (!info.files) return core::ok_status();
  for (const auto& [name, bytes] : *info.files)
    PRESCENE_RETURN_IF_ERROR(writer_->write_attachment({name, media_type_of(name), bytes}));
  return core::ok_status();
}

core::Status RecordingWriter::write(const std::string& topic, const std::string& type, const std::string& kind,
                                    std::uint32_t sequence, core::TimeNs log_ns, core::TimeNs publish_ns,
                                    std::span<const std::uint8_t> data) {
  auto found = channels_.find({topic, kind});
  if (found == channels_.end()) {
    interfaces::McapChannel channel = interfaces::ros_channel(topic, type, topic == tf_static_);
    if (!kind.empty()) channel.metadata[kKindKey] = kind;
    PRESCENE_TRY(const int number, writer_->add_channel(channel));
    found = channels_.emplace(std::pair(topic, kind), number).first;
  }
  const auto clamped = [](core::TimeNs time_ns) { return std::clamp<core::TimeNs>(time_ns, 0, kLatestRecordedNs); };
  return writer_->write({found->second, sequence, clamped(log_ns), clamped(publish_ns), {}}, data);
}

core::Result<MessageIndex> RecordingWriter::write(const interfaces::ReceivedMessage& message) {
  PRESCENE_RETURN_IF_ERROR(write(message.topic, message.type, "", static_cast<std::uint32_t>(next_index_),
                                 message.received_ns, message.source_ns, message.cdr));
  return next_index_++;
}

core::Status RecordingWriter::write_again(const interfaces::ReceivedMessage& message, MessageIndex index) {
  return write(message.topic, message.type, kAgainKind, static_cast<std::uint32_t>(index), message.received_ns,
               message.source_ns, message.cdr);
}

core::Status RecordingWriter::write_snapshot(const std::string& text) {
  return writer_->write_attachment({kSnapshotName, "application/json", {text.begin(), text.end()}});
}

core::Status RecordingWriter::write_json(const std::string& topic, const std::string& json, core::TimeNs time_ns) {
  if (json.size() > most_json_bytes(topic)) {
    return core::resource_exhausted("a document of " + interfaces::size_text(json.size()) + " on " + topic +
                                    " is not recorded; up to " + interfaces::size_text(most_json_bytes(topic)) +
                                    " are");
  }
  return write(topic, kStringType, kJsonKind, sequences_[topic]++, time_ns, time_ns,
               interfaces::encode_cdr(interfaces::RosString{json}));
}

core::Status RecordingWriter::write_output(const std::string& topic, const std::string& type,
                                           std::span<const std::uint8_t> cdr, core::TimeNs stamp_ns,
                                           core::TimeNs time_ns) {
  return write(topic, type, kOutputKind, sequences_[topic]++, time_ns, stamp_ns, cdr);
}

}  // namespace prescene::service
