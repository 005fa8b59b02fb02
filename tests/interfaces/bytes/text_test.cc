// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/text.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>

namespace prescene::interfaces {
namespace {

TEST(Quote, HidesTerminalEscapesAndCutsLongText) {
  EXPECT_EQ(quote("cup"), "'cup'");
  EXPECT_EQ(quote("a\x1b[31m"), "'a\\x1b[31m'");
  EXPECT_EQ(quote("it's\\"), "'it\\'s\\\\'");
  EXPECT_EQ(quote("\xff"), "'\\xff'");
  EXPECT_EQ(quote("abcdef", 3), "'abc...'");
  EXPECT_EQ(quote("abc", 3), "'abc'");
}

TEST(NumberText, ReadsBackAsTheSameNumber) {
  EXPECT_EQ(number_text(3.0), "3");
  EXPECT_EQ(number_text(0.25), "0.25");
  for (const double value : {0.1, 1.0 / 3.0, -1e-300, 6.02e23, std::numeric_limits<double>::denorm_min()}) {
    double back = 0.0;
    ASSERT_TRUE(parse_number(number_text(value), &back));
    EXPECT_EQ(back, value);
  }
  EXPECT_EQ(number_text(std::numeric_limits<double>::infinity()), "inf");
}

TEST(SizeText, PicksAUnit) {
  EXPECT_EQ(size_text(1), "1 byte");
  EXPECT_EQ(size_text(612), "612 bytes");
  EXPECT_EQ(size_text(1536 * 1024), "1.5 MiB");
}

TEST(ParseNumber, TakesTheWholeTextOrNothing) {
  double value = 0.0;
  EXPECT_TRUE(parse_number("-1.5e3", &value));
  EXPECT_EQ(value, -1500.0);
  EXPECT_TRUE(parse_number("+2", &value));
  EXPECT_EQ(value, 2.0);
  EXPECT_TRUE(parse_number("nan", &value));
  EXPECT_TRUE(std::isnan(value));
  for (const char* text : {"", " 1", "1 ", "1,5", "0x10", "+-1", "++1", "1e", "1e999"}) {
    EXPECT_FALSE(parse_number(text, &value)) << text;
  }
}

TEST(ParseInteger, TakesTheWholeTextOrNothing) {
  long long value = 0;
  EXPECT_TRUE(parse_integer("-12", &value));
  EXPECT_EQ(value, -12);
  for (const char* text : {"", "1.0", "9223372036854775808", "a", "1 "})
    EXPECT_FALSE(parse_integer(text, &value)) << text;
}

TEST(Trimmed, RemovesSpaceAtBothEnds) {
  EXPECT_EQ(trimmed(" \ta b\r\n"), "a b");
  EXPECT_EQ(trimmed(" \n"), "");
}

}  // namespace
}  // namespace prescene::interfaces
