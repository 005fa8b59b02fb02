// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bags/other_encodings.h"

#include <gtest/gtest.h>

namespace prescene::interfaces {
namespace {

TEST(OtherEncodings, TenTopicsAreNamedAndAllMessagesCounted) {
  OtherEncodings others;
  EXPECT_FALSE(others.note("/cdr", "cdr"));
  EXPECT_EQ(others.text(), "");
  std::string named;
  for (int i = 0; i < 10; ++i) {
    const std::string topic = "/t" + std::to_string(i);
    for (int twice = 0; twice < 2; ++twice) EXPECT_TRUE(others.note(topic, "json"));
    named += (i == 0 ? "'" : ", '") + topic + "' ('json')";
  }
  EXPECT_EQ(others.text(), "20 messages that are not in CDR were left out: " + named);
  EXPECT_TRUE(others.note("/t10", "json"));
  EXPECT_TRUE(others.note("/t3", "json"));
  EXPECT_FALSE(others.note("/cdr", "cdr"));
  EXPECT_EQ(others.text(), "22 messages that are not in CDR were left out: " + named + " and others");
}

TEST(OtherEncodings, NamesFromAFileCanNotHarmATerminal) {
  OtherEncodings others;
  EXPECT_TRUE(others.note("/a\x1b[2J", "\xc2\x9bm\n"));
  EXPECT_EQ(others.text(), "1 messages that are not in CDR were left out: '/a\\x1b[2J' ('\\xc2\\x9bm\\x0a')");
}

}  // namespace
}  // namespace prescene::interfaces
