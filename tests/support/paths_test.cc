// SPDX-License-Identifier: Apache-2.0
#include "tests/support/paths.h"

#include <gtest/gtest.h>

#include <fstream>

namespace prescene::tests {
namespace {

TEST(Paths, CheckoutHoldsTheTopCMakeLists) { EXPECT_TRUE(std::filesystem::exists(source_dir() / "CMakeLists.txt")); }

TEST(Paths, BuildFolderHoldsTheCache) { EXPECT_TRUE(std::filesystem::exists(build_dir() / "CMakeCache.txt")); }

TEST(Paths, AbsentDataIsNothingAndNamesTheRemedy) {
  EXPECT_FALSE(data_dir("no_such_data_set").has_value());
  EXPECT_NE(missing_data_message("no_such_data_set").find("PRESCENE_DATA"), std::string::npos);
}

TEST(Paths, ScratchFolderIsGoneAfterItsScope) {
  std::filesystem::path path;
  {
    ScratchDir scratch;
    path = scratch.path();
    std::ofstream(path / "file") << "content";
    EXPECT_TRUE(std::filesystem::exists(path / "file"));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace prescene::tests
