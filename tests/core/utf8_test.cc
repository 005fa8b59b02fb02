// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/utf8.h"

#include <gtest/gtest.h>

#include <string>

namespace prescene::core {
namespace {

/// The sequence of a code point by the definition [RFC 3629, section 3], whatever it is.
std::string encoded(unsigned point, int bytes) {
  if (bytes == 1) return std::string(1, static_cast<char>(point));
  std::string text(static_cast<std::size_t>(bytes), '\0');
  for (int i = bytes - 1; i > 0; --i, point >>= 6)
    text[static_cast<std::size_t>(i)] = static_cast<char>(0x80 | (point & 0x3f));
  text[0] = static_cast<char>((0xf00 >> bytes & 0xff) | point);
  return text;
}

int shortest(unsigned point) { return point < 0x80 ? 1 : point < 0x800 ? 2 : point < 0x10000 ? 3 : 4; }

TEST(Utf8, EveryCodePointIsTextInItsShortestFormAndInNoOther) {
  for (unsigned point = 0; point < 0x200000; ++point) {
    const bool is_one = point <= 0x10ffff && (point < 0xd800 || point > 0xdfff);
    for (int bytes = shortest(point); bytes <= 4; ++bytes)
      ASSERT_EQ(is_utf8(encoded(point, bytes)), is_one && bytes == shortest(point)) << point << " in " << bytes;
    const std::string text = "\x7f" + encoded(point, shortest(point));
    ASSERT_EQ(utf8_character_at(text, 1), char32_t{is_one ? point : 0xfffdu});
    ASSERT_EQ(utf8_length_at(text, 1), is_one ? text.size() - 1 : 0u);
  }
}

TEST(Utf8, TheFirstBadByteIsNamed) {
  EXPECT_EQ(not_utf8_at(""), std::nullopt);
  EXPECT_EQ(not_utf8_at("Tasse für Öl \xe2\x82\xac"), std::nullopt);
  EXPECT_EQ(not_utf8_at("\xff"), 0u);
  EXPECT_EQ(not_utf8_at("cam\xff"
                        "era"),
            3u);
  EXPECT_EQ(not_utf8_at("ab\xc3"), 2u);      // cut
  EXPECT_EQ(not_utf8_at("ab\xe2\x82"), 2u);  // cut
  EXPECT_EQ(not_utf8_at("\x80"), 0u);        // a tail alone
}

}  // namespace
}  // namespace prescene::core
