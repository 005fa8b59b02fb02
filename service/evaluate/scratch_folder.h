// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "prescene/core/status.h"

namespace prescene::service {

/// A folder of its own below the system's for temporary files, removed in the end.
class ScratchFolder {
 public:
  static core::Result<std::unique_ptr<ScratchFolder>> create() {
    std::error_code error;
    const std::filesystem::path below = std::filesystem::temp_directory_path(error);
    if (error) return core::unavailable("there is no folder for temporary files: " + error.message());
    std::string name = (below / "prescene_tracking_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
      return core::unavailable(below.string() + ": no folder can be made there: set TMPDIR to one with some 200 MB");
    return std::unique_ptr<ScratchFolder>(new ScratchFolder(name));
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  explicit ScratchFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

}  // namespace prescene::service
