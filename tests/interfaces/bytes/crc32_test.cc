// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/crc32.h"

#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

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

/// Bit by bit, as the polynomial's definition says.
std::uint32_t by_division(std::span<const std::uint8_t> bytes, std::uint32_t start) {
  std::uint32_t remainder = ~start;
  for (const std::uint8_t byte : bytes) {
    remainder ^= byte;
    for (int bit = 0; bit < 8; ++bit) remainder = remainder >> 1 ^ ((remainder & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~remainder;
}

TEST(Crc32, IsThatOfTheDivisionForEveryLengthAlignmentAndStart) {
  std::mt19937 draws(1);
  std::vector<std::uint8_t> bytes(5000);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(draws());
  const std::span all(bytes);
  for (std::size_t size = 0; size <= 400; ++size) {
    const std::size_t at = size % 33;
    const auto start = static_cast<std::uint32_t>(draws());
    ASSERT_EQ(crc32(all.subspan(at, size), start), by_division(all.subspan(at, size), start)) << size;
  }
  for (std::size_t cut = 0; cut < bytes.size(); cut += 37)
    ASSERT_EQ(crc32(all.subspan(cut), crc32(all.first(cut))), by_division(all, 0)) << cut;
}

}  // namespace
}  // namespace prescene::interfaces
