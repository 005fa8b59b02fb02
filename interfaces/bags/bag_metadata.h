// SPDX-License-Identifier: Apache-2.0
// The metadata.yaml of a rosbag2 folder, as far as reading the messages needs it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/status.h"

namespace prescene::interfaces {

struct BagMetadata {
  std::string storage;                       ///< "mcap", "sqlite3"; "" = not said.
  std::string compression;                   ///< "zstd", ...; "" = none.
  std::string compression_mode;              ///< "file", "message", or "" = none; in lower case.
  std::vector<std::filesystem::path> files;  ///< In the folder; checked to be there.
  std::optional<std::uint64_t> message_count;
};

/// kInvalidInput for what is no such file, and where a file that it names would lie outside of the folder; kNotFound
/// where one is not there; kResourceExhausted above kMostBagFiles.
core::Result<BagMetadata> read_bag_metadata(const std::filesystem::path& folder);

/// Of a folder without metadata, as a recorder leaves it that was killed: its .mcap or .db3 files in the order of the
/// numbers in their names ("run_0", "run_1", ... of rosbag2; "run_0", "run_0_0001", ... of ours).
core::Result<BagMetadata> bag_without_metadata(const std::filesystem::path& folder);

inline constexpr const char* kBagMetadataName = "metadata.yaml";
inline constexpr std::size_t kMostBagFiles = 10'000;

/// ".mcap" and ".db3".
bool is_bag_file(const std::filesystem::path& path);

}  // namespace prescene::interfaces
