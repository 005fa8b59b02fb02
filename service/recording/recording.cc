// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/recording/recording.h"

#include <algorithm>
#include <utility>

#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/service/tracking/topics.h"

namespace prescene::service {
namespace {

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

interfaces::McapChannel json_channel(const std::string& topic) {
  return {
      topic, "json", {"prescene" + topic.substr(topic.find_last_of('/')), "jsonschema", R"({"type": "object"})"}, {}};
}

}  // namespace

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
                                     {"settings", info.settings},
                                     {kNumberedKey, kNumbered}}};
  metadata.values[kCrcKey] = crc_text(metadata.values);
  PRESCENE_RETURN_IF_ERROR(mcap->write_metadata(metadata));
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(std::move(mcap)));
}

core::Status RecordingWriter::write(const interfaces::McapChannel& channel, std::uint32_t sequence, core::TimeNs log_ns,
                                    core::TimeNs publish_ns, std::vector<std::uint8_t> data) {
  auto found = channels_.find(channel.topic);
  if (found == channels_.end()) {
    PRESCENE_TRY(const int number, writer_->add_channel(channel));
    found = channels_.emplace(channel.topic, number).first;
  }
  const auto clamped = [](core::TimeNs time_ns) { return std::clamp<core::TimeNs>(time_ns, 0, kLatestRecordedNs); };
  return writer_->write({found->second, sequence, clamped(log_ns), clamped(publish_ns), std::move(data)});
}

core::Result<MessageIndex> RecordingWriter::write(const interfaces::ReceivedMessage& message) {
  PRESCENE_RETURN_IF_ERROR(write(interfaces::ros_channel(message.topic, message.type),
                                 static_cast<std::uint32_t>(next_index_), message.received_ns, message.source_ns,
                                 message.cdr));
  return next_index_++;
}

core::Status RecordingWriter::write_json(const std::string& topic, const std::string& json, core::TimeNs time_ns) {
  if (json.size() > most_json_bytes(topic)) {
    return core::resource_exhausted("a document of " + interfaces::size_text(json.size()) + " on " + topic +
                                    " is not recorded; up to " + interfaces::size_text(most_json_bytes(topic)) +
                                    " are");
  }
  return write(json_channel(topic), sequences_[topic]++, time_ns, time_ns, {json.begin(), json.end()});
}

core::Result<std::unique_ptr<RecordingReader>> RecordingReader::open(const std::filesystem::path& path,
                                                                     const RecordingReadOptions& options) {
  interfaces::McapReaderOptions mcap_options;
  mcap_options.salvage = options.salvage;
  mcap_options.check_data = options.check_data;
  PRESCENE_TRY(auto mcap, interfaces::McapReader::open(path, mcap_options));
  std::unique_ptr<RecordingReader> reader(new RecordingReader(std::move(mcap), options.salvage));
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
  }
  return reader;
}

std::string RecordingReader::loss_text() const {
  std::string text = reader_->loss().text();
  const auto say = [&text](const std::string& sentence) { text += (text.empty() ? "" : "; ") + sentence; };
  const auto& channels = reader_->channels();
  const bool is_ours =
      std::any_of(channels.begin(), channels.end(), [](const auto& channel) { return channel.topic == kStepTopic; });
  if (info_is_damaged_)
    say("its scene, seed and settings are damaged");
  else if (is_ours && !has_info_)
    say("its scene, seed and settings are not there");
  if (too_long_json_ > 0) say(std::to_string(too_long_json_) + " JSON documents above the size limit were left out");
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

core::Result<std::optional<RecordedEntry>> RecordingReader::next() {
  for (;;) {
    PRESCENE_TRY(std::optional<interfaces::McapMessage> message, reader_->next());
    if (!message) return std::optional<RecordedEntry>();
    const interfaces::McapChannel& channel = reader_->channels()[static_cast<std::size_t>(message->channel)];
    const bool is_json = channel.message_encoding == "json";
    if (std::max(message->publish_time_ns, message->log_time_ns) > kLatestRecordedNs) {
      return core::data_loss("the recording has a message on " + channel.topic +
                             " from after the year 2116: its times are wrong");
    }
    if (is_json && is_parsed_in_recordings(channel.topic) && message->data.size() > kMostParsedJsonBytes) {
      if (!salvage_) {
        return core::resource_exhausted("the recording has a JSON document of " +
                                        interfaces::size_text(message->data.size()) + " on " + channel.topic +
                                        "; up to " + interfaces::size_text(kMostParsedJsonBytes) + " are read");
      }
      ++too_long_json_;
      continue;
    }
    RecordedEntry entry;
    entry.message = {channel.topic, channel.schema.name, std::move(message->data), message->publish_time_ns,
                     message->log_time_ns};
    entry.is_json = is_json;
    if (!is_json) entry.index = index_of(message->sequence);
    return std::optional<RecordedEntry>(std::move(entry));
  }
}

}  // namespace prescene::service
