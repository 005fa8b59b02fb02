// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/recording.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

constexpr const char* kStringType = "std_msgs/msg/String";
constexpr const char* kMetadataName = "prescene";
constexpr const char* kCrcKey = "crc32";
// Present where the sequence of a robot message is its number (its lower 32 bits), so that what a gap took away is
// known. Other programs count each topic.
constexpr const char* kNumberedKey = "sequences";
constexpr const char* kNumbered = "over all topics";

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

// In the metadata of the channels that are ours: what they are for. Those of the robot have none.
constexpr const char* kKindKey = "prescene";
constexpr const char* kJsonKind = "json";
constexpr const char* kOutputKind = "output";
// Present where all files that the scene names are attached.
constexpr const char* kAttachedKey = "attached_files";

std::string kind_of(const interfaces::McapChannel& channel) {
  const auto kind = channel.metadata.find(kKindKey);
  return kind == channel.metadata.end() ? std::string() : kind->second;
}

std::string media_type_of(const std::string& name) {
  const std::string extension = std::filesystem::path(name).extension().string();
  if (extension == ".yaml" || extension == ".yml") return "application/yaml";
  return extension.empty() ? "application/octet-stream" : "model/" + extension.substr(1);
}

}  // namespace

bool holds_own_json(const interfaces::McapChannel& channel) { return kind_of(channel) == kJsonKind; }

bool is_own_output(const interfaces::McapChannel& channel) { return kind_of(channel) == kOutputKind; }

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
                                                                       const RecordingInfo& info,
                                                                       const RecordingSafety& safety) {
  interfaces::McapWriterOptions options;
  options.chunk_ns = core::ns_of(safety.kept_back_s);
  options.sync_interval = std::chrono::milliseconds(std::llround(1e3 * safety.unsynced_s));
  PRESCENE_TRY(auto mcap, interfaces::McapWriter::create(path, options));
  interfaces::McapMetadata metadata{kMetadataName,
                                    {{"scene_file", info.scene_file},
                                     {"scene_text", info.scene_text},
                                     {"seed", std::to_string(info.seed)},
                                     {"settings", info.settings},
                                     {kNumberedKey, kNumbered}}};
  if (info.files) metadata.values[kAttachedKey] = std::to_string(info.files->size());
  metadata.values[kCrcKey] = crc_text(metadata.values);
  PRESCENE_RETURN_IF_ERROR(mcap->write_metadata(metadata));
  if (!info.scene_text.empty()) {
    // For people: the text above is what is replayed.
    const std::string name = std::filesystem::path(info.scene_file).filename().string();
    PRESCENE_RETURN_IF_ERROR(mcap->write_attachment(
        {name.empty() ? "scene.yaml" : name, "application/yaml", {info.scene_text.begin(), info.scene_text.end()}}));
  }
  if (info.files) {
    for (const auto& [name, bytes] : *info.files)
      PRESCENE_RETURN_IF_ERROR(mcap->write_attachment({name, media_type_of(name), bytes}));
  }
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(std::move(mcap)));
}

core::Status RecordingWriter::write(const std::string& topic, const std::string& type, const std::string& kind,
                                    std::uint32_t sequence, core::TimeNs log_ns, core::TimeNs publish_ns,
                                    std::span<const std::uint8_t> data) {
  auto found = channels_.find({topic, kind});
  if (found == channels_.end()) {
    interfaces::McapChannel channel = interfaces::ros_channel(topic, type);
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

core::Result<std::unique_ptr<RecordingReader>> RecordingReader::open(const std::filesystem::path& path,
                                                                     const RecordingReadOptions& options) {
  PRESCENE_TRY(auto bag, interfaces::BagReader::open(path, {options.salvage, options.check_data}));
  std::unique_ptr<RecordingReader> reader(new RecordingReader(std::move(bag), options));
  for (const interfaces::McapMetadata& metadata : reader->reader_->metadata()) {
    if (metadata.name != kMetadataName) continue;
    const auto crc = metadata.values.find(kCrcKey);
    if (crc == metadata.values.end() || crc->second != crc_text(metadata.values)) {
      if (!options.salvage) {
        return core::data_loss(path.string() + ": the checksum of its scene, seed and settings is " +
                               (crc == metadata.values.end() ? "missing" : "wrong") +
                               "; copy it again, or read what is sound by `replay --salvage`");
      }
      reader->info_is_damaged_ = true;
      continue;
    }
    reader->has_info_ = true;
    const auto value = [&metadata](const char* key) {
      const auto found = metadata.values.find(key);
      return found == metadata.values.end() ? std::string() : found->second;
    };
    reader->info_.scene_file = value("scene_file");
    reader->info_.scene_text = value("scene_text");
    reader->info_.settings = value("settings");
    reader->info_.seed = std::strtoull(value("seed").c_str(), nullptr, 10);
    reader->is_numbered_ = value(kNumberedKey) == kNumbered;
    reader->has_attached_scene_ = metadata.values.contains(kAttachedKey);
  }
  return reader;
}

std::string RecordingReader::loss_text() const {
  std::string text = reader_->loss_text();
  const auto say = [&text](const std::string& sentence) { text += (text.empty() ? "" : "; ") + sentence; };
  const auto& channels = reader_->channels();
  const bool is_ours =
      std::any_of(channels.begin(), channels.end(), [](const auto& channel) { return channel.topic == kStepTopic; });
  if (info_is_damaged_)
    say("its scene, seed and settings are damaged");
  else if (is_ours && !has_info_)
    say("its scene, seed and settings are not there");
  if (too_long_json_ > 0) say(std::to_string(too_long_json_) + " JSON documents above the size limit were left out");
  if (damaged_json_ > 0) say(std::to_string(damaged_json_) + " messages that should hold JSON are no texts");
  return text;
}

/// The message nearest to the one expected whose number has these lower bits.
MessageIndex RecordingReader::index_of(std::uint32_t sequence) {
  if (is_numbered_) {
    const auto ahead = static_cast<std::int32_t>(sequence - static_cast<std::uint32_t>(next_index_));
    // Only a crafted file counts to before its first message.
    const bool is_before_all = ahead < 0 && next_index_ < MessageIndex{0} - static_cast<MessageIndex>(ahead);
    if (!is_before_all) next_index_ += static_cast<MessageIndex>(ahead);
  }
  return next_index_++;
}

core::Result<std::vector<std::uint8_t>> RecordingReader::read_attached(const std::string& name) const {
  PRESCENE_TRY(interfaces::McapAttachment file, reader_->attachment(name));
  return std::move(file.data);
}

/// Empty where it was left out.
core::Result<std::optional<RecordedEntry>> RecordingReader::own_json(const interfaces::McapChannel& channel,
                                                                     interfaces::McapMessage message) {
  RecordedEntry entry;
  entry.is_json = true;
  entry.message = {channel.topic, channel.schema.name, std::move(message.data), message.publish_time_ns,
                   message.log_time_ns};
  std::vector<std::uint8_t>& data = entry.message.cdr;
  // The text may have a head, a length and an end around it.
  constexpr std::size_t kAroundText = 9;
  const std::size_t size = data.size() - std::min(data.size(), kAroundText);
  if (is_parsed_in_recordings(channel.topic) && size > kMostParsedJsonBytes) {
    if (!options_.salvage) {
      return core::resource_exhausted("the recording has a JSON document of " + interfaces::size_text(size) + " on " +
                                      channel.topic + "; up to " + interfaces::size_text(kMostParsedJsonBytes) +
                                      " are read");
    }
    ++too_long_json_;
    return std::optional<RecordedEntry>();
  }
  const auto text = interfaces::decode_cdr<interfaces::RosString>(data);
  if (!text && !options_.salvage) return text.status().at("the recording's " + channel.topic);
  if (!text) {
    ++damaged_json_;
    return std::optional<RecordedEntry>();
  }
  data.assign(text->data.begin(), text->data.end());
  return std::optional<RecordedEntry>(std::move(entry));
}

bool RecordingReader::is_needed_later(const interfaces::McapChannel& channel, double before) const {
  constexpr double kTransformSeconds = 10.0;
  if (channel.schema.name == "tf2_msgs/msg/TFMessage")
    return before <= kTransformSeconds || channel.topic.ends_with("static");
  if (channel.schema.name == "sensor_msgs/msg/JointState") return before <= kTransformSeconds;
  return channel.schema.name == "sensor_msgs/msg/CameraInfo" || channel.topic == kSettingsTopic;
}

core::Result<std::optional<RecordedEntry>> RecordingReader::next() {
  for (;;) {
    PRESCENE_TRY(std::optional<interfaces::McapMessage> message, reader_->next());
    if (!message) {
      if (first_ns_ && options_.from > last_at_) {
        return core::invalid_input("the recording ends at " + core::fixed_text(last_at_, 2) +
                                   " s: begin before (--from)");
      }
      return std::optional<RecordedEntry>();
    }
    const interfaces::McapChannel& channel = reader_->channels()[static_cast<std::size_t>(message->channel)];
    if (std::max(message->publish_time_ns, message->log_time_ns) > kLatestRecordedNs) {
      return core::data_loss("the recording has a message on " + channel.topic +
                             " from after the year 2116: its times are wrong");
    }
    if (!first_ns_) first_ns_ = message->log_time_ns;
    const double at = core::seconds_of(message->log_time_ns - *first_ns_);
    last_at_ = std::max(last_at_, at);
    // Files without an index are read in their order, which may differ from that of time, though not by much.
    constexpr double kMostDisorder = 10.0;
    if (at > options_.to + kMostDisorder) return std::optional<RecordedEntry>();
    if (at > options_.to) continue;
    const std::string kind = kind_of(channel);
    if (kind == kOutputKind || (kind == kJsonKind && at < options_.from)) continue;
    if (kind == kJsonKind) {
      PRESCENE_TRY(auto entry, own_json(channel, *std::move(message)));
      if (entry) return entry;
      continue;
    }
    RecordedEntry entry;
    entry.message = {channel.topic, channel.schema.name, std::move(message->data), message->publish_time_ns,
                     message->log_time_ns};
    entry.index = index_of(message->sequence);
    if (at < options_.from && !is_needed_later(channel, options_.from - at)) continue;
    return std::optional<RecordedEntry>(std::move(entry));
  }
}

}  // namespace prescene::service
