// SPDX-License-Identifier: Apache-2.0
// SQLite files as the versions of rosbag2 lay them out, and others.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace prescene::tests {

/// The tables of rosbag2: of its schema versions 1 (Dashing), 2 (Eloquent, without a table `schema`), 3 (Humble) and 4
/// (Jazzy).
enum class Db3Layout { kDashing, kEloquent, kHumble, kJazzy };

struct Db3Topic {
  std::string name;
  std::string type;
  std::string format = "cdr";
};

struct Db3Message {
  std::int64_t topic = 1;  ///< From 1, in the order of the topics.
  std::int64_t time_ns = 0;
  std::vector<std::uint8_t> data;
};

/// Writes the file with pages of 512 bytes, so that small files have many and long messages overflow. Aborts on errors.
void write_db3(const std::filesystem::path& path, const std::vector<Db3Topic>& topics,
               const std::vector<Db3Message>& messages, Db3Layout layout = Db3Layout::kHumble);

/// Runs SQL on a file, which is made if it is not there. Aborts on errors.
void run_sql(const std::filesystem::path& path, const std::string& sql);

/// A metadata.yaml of rosbag2 (its version 5) that names these files.
std::string bag_metadata(const std::string& storage, const std::vector<std::string>& files, std::size_t messages);

}  // namespace prescene::tests
