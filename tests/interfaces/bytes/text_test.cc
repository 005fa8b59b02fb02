// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/text.h"

#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>
#include <optional>

#include "prescene/core/utf8.h"

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

TEST(Printable, EscapesWhatATerminalWouldObeyAndNothingElse) {
  EXPECT_EQ(printable("T\xc3\xbcr 'a\\b'"), "T\xc3\xbcr 'a\\b'");
  EXPECT_EQ(printable("a\x1b[31m\r\n\tb\x7f"), "a\\x1b[31m\\x0d\\x0a\\x09b\\x7f");
  EXPECT_EQ(printable("\xc2\x9b\x32J\xc2\xa0"), "\\xc2\\x9b2J\xc2\xa0") << "U+009B is a control, U+00A0 a space";
  EXPECT_EQ(printable("\xff\xe2\x82"), "\\xff\\xe2\\x82") << "neither is UTF-8";
  EXPECT_EQ(printable(std::string_view("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable_lines("a\x1b\n\tb\r\n"), "a\\x1b\n\tb\\x0d\n");
}

TEST(Printable, LeavesNoControlByteOfAnyOneOrTwoBytes) {
  for (int a = 0; a < 256; ++a)
    for (int b = 0; b < 256; ++b) {
      const std::string text = {static_cast<char>(a), static_cast<char>(b)};
      const std::string shown = printable(text);
      EXPECT_TRUE(core::is_utf8(shown)) << a << " " << b;
      for (std::size_t i = 0; i < shown.size(); i += core::utf8_length_at(shown, i)) {
        const char32_t character = core::utf8_character_at(shown, i);
        EXPECT_FALSE(character < 0x20 || (character >= 0x7f && character < 0xa0)) << a << " " << b;
      }
      EXPECT_EQ(printable(shown), shown) << a << " " << b;
    }
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

TEST(FiniteNumber, IsAWholeTextThatIsNeitherInfiniteNorNoNumber) {
  EXPECT_EQ(finite_number("-1.5e3"), -1500.0);
  EXPECT_EQ(finite_number("+0.25"), 0.25);
  for (const char* text : {"", "nan", "inf", "-inf", "infinity", "1 ", " 1", "0x10", "1,5", "1e999"})
    EXPECT_EQ(finite_number(text), std::nullopt) << text;
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
