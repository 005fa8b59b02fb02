// SPDX-License-Identifier: Apache-2.0
// Where tests find files: the checkout, the build folder, the recorded data, and a folder of their own to write into.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace prescene::tests {

/// The root of the checkout; the environment variable PRESCENE_SOURCE_DIR overrides it.
std::filesystem::path source_dir();

/// The build folder, where the program `prescene` lies; the environment variable PRESCENE_BUILD_DIR overrides it.
std::filesystem::path build_dir();

/// The folder `name` of the recorded data below $PRESCENE_DATA (default: ../shared/data beside the checkout), nothing
/// where it is absent. Tests then skip: `GTEST_SKIP() << missing_data_message("ycb_video")`.
std::optional<std::filesystem::path> data_dir(std::string_view name);

/// Says which data set is absent, where it was looked for and how to point at it.
std::string missing_data_message(std::string_view name);

/// A folder that exists and is empty when made, and is removed with everything in it at the end of its scope.
class ScratchDir {
 public:
  ScratchDir();
  ~ScratchDir();
  ScratchDir(const ScratchDir&) = delete;
  ScratchDir& operator=(const ScratchDir&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace prescene::tests
