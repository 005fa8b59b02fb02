// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/crc32.h"

#include <gtest/gtest.h>

#include <string_view>

namespace prescene::interfaces {
namespace {

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(Crc32, GivesThePublishedCheckValueInOneOrTwoParts) {
  EXPECT_EQ(crc32(bytes_of("123456789")), 0xcbf43926U);
  EXPECT_EQ(crc32(bytes_of("6789"), crc32(bytes_of("12345"))), 0xcbf43926U);
  EXPECT_EQ(crc32({}, 0x1234U), 0x1234U);
  EXPECT_EQ(crc32({}), 0U);
}

}  // namespace
}  // namespace prescene::interfaces
