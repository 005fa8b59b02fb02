// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bags/bag_writer.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "bag_metadata.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mcap/mcap_reader.h"
#include "prescene/interfaces/mcap/mcap_writer.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

struct Span {
  std::int64_t first_ns = 0, last_ns = 0;
  std::uint64_t messages = 0;

  void add(const Span& other) {
    if (other.messages == 0) return;
    first_ns = messages == 0 ? other.first_ns : std::min(first_ns, other.first_ns);
    last_ns = messages == 0 ? other.last_ns : std::max(last_ns, other.last_ns);
    messages += other.messages;
  }
};

struct BagTopic {
  std::string encoding;
  std::string offered_qos = offered_qos_profiles(/*is_latched=*/false);
  std::uint64_t messages = 0;
};
/// By name and type.
using BagTopics = std::map<std::pair<std::string, std::string>, BagTopic>;

/// What a file holds; adds to the topics.
Result<Span> take_file(const std::filesystem::path& file, BagTopics& topics) {
  McapReaderOptions options;
  options.salvage = true;
  options.check_data = false;
  PRESCENE_TRY(const auto reader, McapReader::open(file, options));
  const auto add = [&topics](const McapChannel& channel, std::uint64_t messages) {
    BagTopic& topic = topics[{channel.topic, channel.schema.name}];
    topic.encoding = channel.message_encoding;
    const auto offered = channel.metadata.find(kOfferedQosKey);
    if (offered != channel.metadata.end() && !offered->second.empty()) topic.offered_qos = offered->second;
    topic.messages += messages;
  };
  if (const auto known = reader->statistics()) {
    for (std::size_t i = 0; i < known->by_channel.size(); ++i) add(reader->channels()[i], known->by_channel[i]);
    return Span{known->first_ns, known->last_ns, known->messages};
  }
  Span span;
  for (;;) {
    PRESCENE_TRY(const auto message, reader->next());
    if (!message) return span;
    add(reader->channels()[static_cast<std::size_t>(message->channel)], 1);
    span.add({message->log_time_ns, message->log_time_ns, 1});
  }
}

/// In double quotes, as YAML reads it.
std::string quoted_yaml(const std::string& text) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (c == '\n') {
      out += "\\n";
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += {'\\', 'x', kDigits[static_cast<unsigned char>(c) >> 4U], kDigits[static_cast<unsigned char>(c) & 15U]};
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string times_text(const Span& span, const std::string& indent) {
  return indent + "duration:\n" + indent + "  nanoseconds: " + std::to_string(span.last_ns - span.first_ns) + "\n" +
         indent + "starting_time:\n" + indent + "  nanoseconds_since_epoch: " + std::to_string(span.first_ns) + "\n" +
         indent + "message_count: " + std::to_string(span.messages) + "\n";
}

}  // namespace

Status write_bag_metadata(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& files) {
  BagTopics topics;
  Span all;
  std::string paths, of_files;
  for (const std::filesystem::path& file : files) {
    PRESCENE_TRY(const Span span, take_file(file, topics));
    all.add(span);
    const std::string name = quoted_yaml(file.filename().string());
    paths += "    - " + name + "\n";
    of_files += "    - path: " + name + "\n" + times_text(span, "      ");
  }
  std::string text = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n" + times_text(all, "  ");
  text += std::string("  topics_with_message_count:") + (topics.empty() ? " []\n" : "\n");
  for (const auto& [key, topic] : topics) {
    text += "    - topic_metadata:\n        name: " + quoted_yaml(key.first) +
            "\n        type: " + quoted_yaml(key.second) +
            "\n        serialization_format: " + quoted_yaml(topic.encoding) +
            "\n        offered_qos_profiles: " + quoted_yaml(topic.offered_qos) +
            "\n      message_count: " + std::to_string(topic.messages) + "\n";
  }
  // The compression of MCAP's chunks is none of rosbag2's.
  text += "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n" + paths + "  files:\n" +
          of_files;
  return write_file(folder / kBagMetadataName, std::string_view(text));
}

}  // namespace prescene::interfaces
