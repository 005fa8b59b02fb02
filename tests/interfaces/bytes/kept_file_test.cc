// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/kept_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(KeptFile, HoldsTheNewestTextAndLeavesNoOtherFile) {
  const tests::ScratchDir scratch;
  const auto path = scratch.path() / "kept";
  {
    KeptFile kept(path);
    EXPECT_FALSE(std::filesystem::exists(path));
    kept.put("one");
    EXPECT_TRUE(kept.wait().ok());
    EXPECT_EQ(content(path), "one");
    for (int i = 0; i < 50; ++i) kept.put(std::to_string(i));
    EXPECT_TRUE(kept.wait().ok());
    EXPECT_EQ(content(path), "49");
    kept.put("at the end");
  }
  EXPECT_EQ(content(path), "at the end");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1);
}

TEST(KeptFile, ReplacesWhatALinkNames) {
  const tests::ScratchDir scratch;
  std::ofstream(scratch.path() / "target") << "old";
  std::filesystem::create_symlink("target", scratch.path() / "link");
  KeptFile kept(scratch.path() / "link");
  kept.put("text");
  EXPECT_TRUE(kept.wait().ok());
  EXPECT_TRUE(std::filesystem::is_symlink(scratch.path() / "link"));
  EXPECT_EQ(content(scratch.path() / "target"), "text");
}

TEST(KeptFile, TellsWhyItCannotBeWrittenUntilItCan) {
  const tests::ScratchDir scratch;
  const auto path = scratch.path() / "folder" / "kept";
  KeptFile kept(path);
  kept.put("lost");
  EXPECT_EQ(kept.wait().code(), core::StatusCode::kUnavailable);
  EXPECT_EQ(kept.status().code(), core::StatusCode::kUnavailable) << "stays";
  EXPECT_NE(kept.status().message().find("its folder does not exist"), std::string::npos) << kept.status().message();
  std::filesystem::create_directory(scratch.path() / "folder");
  kept.put("here");
  EXPECT_TRUE(kept.wait().ok());
  EXPECT_EQ(content(path), "here");
}

}  // namespace
}  // namespace prescene::interfaces
