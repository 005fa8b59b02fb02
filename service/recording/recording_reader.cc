// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/outside_json.h"
#include "prescene/service/recording/recording.h"
#include "prescene/service/tracking/topics.h"
#include "recording_format.h"

namespace prescene::service {
namespace {

void add_sentence(std::string& text, const std::string& sentence) { text += (text.empty() ? "" : "; ") + sentence; }

/// The first file of a bag of several that we recorded: what each says of itself, a BagReader passes over. Nothing
/// where the path is none, or it can't be read as one.
std::optional<std::filesystem::path> first_of_own_bag(const std::filesystem::path& path) {
  std::error_code none;
  if (!std::filesystem::is_directory(path, none)) return std::nullopt;
  const auto bag = interfaces::BagReader::open(path, {.salvage = true, .check_data = false});
  if (!bag || (*bag)->files().size() < 2) return std::nullopt;
  const std::filesystem::path first = (*bag)->files().front();
  const auto part = part_of(first);
  if (!part || part->series.empty() || part->number != 0) return std::nullopt;
  return first;
}

}  // namespace

core::Result<std::unique_ptr<RecordingReader>> RecordingReader::open(const std::filesystem::path& path,
                                                                     const RecordingReadOptions& options) {
  const std::optional<std::filesystem::path> first = first_of_own_bag(path);
  if (first) {
    RecordingReadOptions all = options;
    all.all_parts = true;
    return open(*first, all);
  }
  std::unique_ptr<RecordingReader> reader(new RecordingReader(options));
  PRESCENE_RETURN_IF_ERROR(reader->open_file(path));
  if (options.all_parts)
    reader->parts_ = parts_after(path, reader->part_, std::numeric_limits<std::size_t>::max(), &reader->passed_over_);
  return reader;
}

std::vector<std::filesystem::path> RecordingReader::files() const {
  std::vector<std::filesystem::path> files = reader_->files();
  files.insert(files.end(), parts_.begin(), parts_.end());
  return files;
}

core::Status RecordingReader::open_file(const std::filesystem::path& path) {
  const bool is_first = reader_ == nullptr;
  PRESCENE_TRY(reader_, interfaces::BagReader::open(path, {options_.salvage, options_.check_data}));
  path_ = path;
  RecordingInfo info;
  for (const interfaces::McapMetadata& metadata : reader_->metadata()) {
    if (metadata.name != kMetadataName) continue;
    const auto crc = metadata.values.find(kCrcKey);
    if (crc == metadata.values.end() || crc->second != crc_text(metadata.values)) {
      if (!options_.salvage) {
        return core::data_loss(path.string() + ": the checksum of its scene, seed and settings is " +
                               (crc == metadata.values.end() ? "missing" : "wrong") +
                               "; copy it again, or read what is sound by `replay --salvage`");
      }
      info_is_damaged_ = true;
      continue;
    }
    has_info_ = true;
    const auto value = [&metadata](const char* key) {
      const auto found = metadata.values.find(key);
      return found == metadata.values.end() ? std::string() : found->second;
    };
    info.scene_file = value("scene_file");
    info.scene_text = value("scene_text");
    info.settings = value("settings");
    info.seed = std::strtoull(value("seed").c_str(), nullptr, 10);
    info.part = part_from(metadata);
    is_numbered_ = value(kNumberedKey) == kNumbered;
    has_attached_scene_ = metadata.values.contains(kAttachedKey);
  }
  part_ = info.part;
  if (is_first) {
    info_ = std::move(info);
    const auto settings = parse_or_discard(info_.settings, kMostParsedJsonBytes);
    if (settings.is_object() && settings.contains("tf_static_topic") && settings["tf_static_topic"].is_string())
      tf_static_ = settings["tf_static_topic"].get<std::string>();
  }
  // A belief that nothing new followed was not taken up.
  if (starts_ && !starts_->goes_on) misses_some_ = true;
  starts_.reset();
  if (part_.number > 0) {
    starts_ = std::make_shared<PartStart>();
    starts_->number = part_.number;
    const bool follows = !is_first && !part_.after_gap && part_.first_message == next_index_;
    if (!is_first && part_.first_message > next_index_) miss_before(part_.first_message - next_index_);
    const bool is_from_start = !is_first || !(options_.from > 0.0);
    if ((!follows || misses_some_) && is_from_start)
      if (const auto snapshot = reader_->attachment(kSnapshotName))
        starts_->snapshot.assign(snapshot->data.begin(), snapshot->data.end());
    starts_->goes_on = follows && starts_->snapshot.empty();
    if (!starts_->snapshot.empty()) misses_some_ = false;
  }
  next_index_ = part_.first_message;
  return core::ok_status();
}

core::Result<bool> RecordingReader::open_next_part() {
  if (!options_.all_parts || parts_.empty()) {
    for (const PassedOver& last : std::exchange(passed_over_, {}))
      if (last.after == opened_parts_ && !last.is_readable)
        for (std::string* text : {&lost_, &missing_})
          add_sentence(*text, last.file.filename().string() + ": it can't be read");
    return false;
  }
  const auto join = [this](std::string& to, const std::string& text) {
    if (!text.empty()) add_sentence(to, path_.filename().string() + ": " + text);
  };
  const std::string lost = reader_->loss_text();
  misses_some_ = misses_some_ || !lost.empty();
  join(lost_, lost);
  join(unchecked_, reader_->unchecked_text());
  const std::filesystem::path path = parts_.front();
  parts_.erase(parts_.begin());
  PRESCENE_RETURN_IF_ERROR(open_file(path));
  ++opened_parts_;
  return true;
}

void RecordingReader::miss_before(std::uint64_t messages) {
  std::string sentence = path_.filename().string() + ": " + std::to_string(messages) + " messages before it " +
                         (part_.after_gap ? "were not recorded" : "are not there");
  std::string passed;
  bool is_missing = !part_.after_gap;
  for (const PassedOver& file : passed_over_) {
    if (file.after != opened_parts_) continue;
    passed += (passed.empty() ? "" : ", ") + file.file.filename().string();
    is_missing = is_missing || !file.is_readable;
  }
  if (!passed.empty()) sentence += " (passed over, as they are no readable parts of the recording: " + passed + ")";
  add_sentence(lost_, sentence);
  if (is_missing) add_sentence(missing_, sentence);
  misses_some_ = true;
}

std::string RecordingReader::unchecked_text() const {
  const std::string here = reader_->unchecked_text();
  return unchecked_ + (unchecked_.empty() || here.empty() ? "" : "; ") + here;
}

std::string RecordingReader::loss_text() const {
  std::string text = lost_;
  const auto say = [&text](const std::string& sentence) { add_sentence(text, sentence); };
  if (const std::string here = reader_->loss_text(); !here.empty()) say(here);
  const auto& channels = reader_->channels();
  const bool is_ours =
      std::any_of(channels.begin(), channels.end(), [](const auto& channel) { return channel.topic == kStepTopic; });
  if (info_is_damaged_)
    say("its scene, seed and settings are damaged");
  else if (is_ours && !has_info_)
    say("its scene, seed and settings are not there");
  if (too_long_json_ > 0) say(std::to_string(too_long_json_) + " JSON documents above the size limit were left out");
  if (damaged_json_ > 0) say(std::to_string(damaged_json_) + " messages that should hold JSON are no texts");
  if (const std::string others = other_encodings_.text(); !others.empty()) say(others);
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
    return before <= kTransformSeconds ||
           (tf_static_.empty() ? channel.topic.ends_with("static") : channel.topic == tf_static_);
  if (channel.schema.name == "sensor_msgs/msg/JointState") return before <= kTransformSeconds;
  return channel.schema.name == "sensor_msgs/msg/CameraInfo" || channel.topic == kSettingsTopic;
}

bool RecordingReader::is_needed_again(const interfaces::McapChannel& channel, core::TimeNs log_ns) const {
  if (!starts_ || starts_->goes_on) return false;
  if (!starts_->snapshot.empty()) return true;
  return is_needed_later(channel, core::seconds_of(part_.began_ns - log_ns) + (first_ns_ ? 0.0 : options_.from));
}

void RecordingReader::mark_start(RecordedEntry& entry) {
  if (starts_) entry.part = std::exchange(starts_, nullptr);
}

core::Result<std::optional<RecordedEntry>> RecordingReader::next() {
  for (;;) {
    PRESCENE_TRY(std::optional<interfaces::McapMessage> message, reader_->next());
    if (!message) {
      PRESCENE_TRY(const bool goes_on, open_next_part());
      if (goes_on) continue;
      if (first_ns_ && options_.from > last_at_) {
        return core::invalid_input("the recording ends at " + core::fixed_text(last_at_, 2) +
                                   " s: begin before (--from)");
      }
      return std::optional<RecordedEntry>();
    }
    const interfaces::McapChannel& channel = reader_->channels()[static_cast<std::size_t>(message->channel)];
    if (std::max(message->publish_time_ns, message->log_time_ns) > kLatestRecordedNs) {
      return core::data_loss("the recording has a message on " + interfaces::quote(channel.topic) +
                             " from after the year 2116: its times are wrong");
    }
    const std::string kind = kind_of(channel);
    if (kind == kAgainKind) {
      if (!is_needed_again(channel, message->log_time_ns)) continue;
      RecordedEntry entry;
      entry.message = {channel.topic, channel.schema.name, std::move(message->data), message->publish_time_ns,
                       message->log_time_ns};
      const MessageIndex next_new = next_index_;
      entry.index = index_of(message->sequence);
      next_index_ = next_new;
      return std::optional<RecordedEntry>(std::move(entry));
    }
    if (!first_ns_) first_ns_ = message->log_time_ns;
    const double at = core::seconds_of(message->log_time_ns - *first_ns_);
    last_at_ = std::max(last_at_, at);
    // Files without an index are read in their order, which may differ from that of time, though not by much.
    constexpr double kMostDisorder = 10.0;
    if (at > options_.to + kMostDisorder) return std::optional<RecordedEntry>();
    if (at > options_.to) continue;
    if (kind == kOutputKind || (kind == kJsonKind && at < options_.from)) continue;
    if (kind == kJsonKind) {
      PRESCENE_TRY(auto entry, own_json(channel, *std::move(message)));
      if (!entry) continue;
      mark_start(*entry);
      return entry;
    }
    if (other_encodings_.note(channel.topic, channel.message_encoding)) continue;
    RecordedEntry entry;
    entry.message = {channel.topic, channel.schema.name, std::move(message->data), message->publish_time_ns,
                     message->log_time_ns};
    entry.index = index_of(message->sequence);
    if (at < options_.from && !is_needed_later(channel, options_.from - at)) continue;
    mark_start(entry);
    return std::optional<RecordedEntry>(std::move(entry));
  }
}

}  // namespace prescene::service
