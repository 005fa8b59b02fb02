// SPDX-License-Identifier: Apache-2.0
// One SQLite file of rosbag2, of any version of its schema: the columns are looked at, not the version's number.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/mcap/mcap.h"

namespace prescene::interfaces {

/// What a file claims is not believed: SQLite checks lengths against its pages; views, virtual tables and triggers of
/// the file are not used; sizes and the work for a message are bounded.
class Db3Reader {
 public:
  static core::Result<std::unique_ptr<Db3Reader>> open(const std::filesystem::path& path, bool salvage);
  ~Db3Reader();
  Db3Reader(const Db3Reader&) = delete;
  Db3Reader& operator=(const Db3Reader&) = delete;

  const std::vector<McapChannel>& channels() const;
  /// In the order of time, of the row among equals.
  core::Result<std::optional<McapMessage>> next();
  std::string loss_text() const;

 private:
  struct Impl;
  explicit Db3Reader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace prescene::interfaces
