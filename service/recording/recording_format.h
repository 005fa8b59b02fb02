// SPDX-License-Identifier: Apache-2.0
// How the files of recordings are marked, for those who write and read them.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "prescene/interfaces/bytes/crc32.h"
#include "prescene/interfaces/mcap/mcap.h"
#include "prescene/service/recording/recording.h"

namespace prescene::service {

inline constexpr const char* kMetadataName = "prescene";
inline constexpr const char* kCrcKey = "crc32";
// Present where the sequence of a robot message is its number (its lower 32 bits), so that what a gap took away is
// known. Other programs count each topic.
inline constexpr const char* kNumberedKey = "sequences";
inline constexpr const char* kNumbered = "over all topics";

/// Of all values but that of the checksum itself, each with its key.
inline std::string crc_text(const std::map<std::string, std::string>& values) {
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
inline constexpr const char* kKindKey = "prescene";
inline constexpr const char* kJsonKind = "json";
inline constexpr const char* kOutputKind = "output";
// Present where all files that the scene names are attached.
inline constexpr const char* kAttachedKey = "attached_files";
// Of a message that an earlier file of the recording holds, too.
inline constexpr const char* kAgainKind = "again";
// Present where a recording goes on in several files.
inline constexpr const char* kSeriesKey = "series";
/// What the metadata says of a recording that goes on in several files; defaults where that is nothing.
RecordingPart part_from(const interfaces::McapMetadata& metadata);
inline constexpr const char* kSnapshotName = "prescene/belief.json";

inline std::string kind_of(const interfaces::McapChannel& channel) {
  const auto kind = channel.metadata.find(kKindKey);
  return kind == channel.metadata.end() ? std::string() : kind->second;
}

}  // namespace prescene::service
