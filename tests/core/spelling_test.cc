// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/spelling.h"

#include <gtest/gtest.h>

namespace prescene::core {
namespace {

TEST(Spelling, NamesWhatIsNear) {
  EXPECT_EQ(did_you_mean("mgu", {"mug", "bin"}), "did you mean 'mug'?");
  EXPECT_EQ(did_you_mean("cup_3", {"cup_1", "cup_2", "table"}), "did you mean 'cup_1' or 'cup_2'?");
  EXPECT_EQ(did_you_mean("table", {"mug", "bin"}), "");
  EXPECT_EQ(did_you_mean("mug", {}), "");
}

TEST(Spelling, ListsWords) {
  EXPECT_EQ(comma_list({}), "");
  EXPECT_EQ(comma_list({"mug"}), "mug");
  EXPECT_EQ(comma_list({"mug", "bin", "can"}), "mug, bin, can");
}

}  // namespace
}  // namespace prescene::core
