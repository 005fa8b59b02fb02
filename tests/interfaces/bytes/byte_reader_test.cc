// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/byte_reader.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstdint>

namespace prescene::interfaces {
namespace {

constexpr std::array<std::uint8_t, 9> kBytes = {0x01, 0x02, 0x03, 0x04, 0x00, 0x00, 0xc0, 0x3f, 0xff};

TEST(ByteReader, ReadsLittleEndianNumbers) {
  ByteReader in(kBytes);
  EXPECT_EQ(in.read<std::uint32_t>(), 0x04030201U);
  EXPECT_EQ(in.read<float>(), 1.5F);
  EXPECT_EQ(in.read<std::int8_t>(), -1);
  EXPECT_TRUE(in.ok());
  EXPECT_EQ(in.remaining(), 0U);
}

TEST(ByteReader, ReadsBigEndianNumbers) {
  ByteReader in(kBytes, std::endian::big);
  EXPECT_EQ(in.read<std::uint16_t>(), 0x0102U);
  EXPECT_EQ(in.read<std::uint32_t>(), 0x03040000U);
  EXPECT_EQ(in.read<std::uint32_t>(), 0U) << "three bytes are left";
  EXPECT_FALSE(in.ok());
}

TEST(ByteReader, AlignsFromTheFirstByte) {
  ByteReader in(kBytes);
  in.read<std::uint8_t>();
  in.align(4);
  EXPECT_EQ(in.position(), 4U);
  in.align(4);
  EXPECT_EQ(in.position(), 4U);
}

TEST(ByteReader, StaysAtItsPlaceAfterTheFirstReadThatDoesNotFit) {
  ByteReader in(kBytes);
  in.take(7);
  EXPECT_EQ(in.read<std::uint32_t>(), 0U);
  EXPECT_FALSE(in.ok());
  EXPECT_EQ(in.read<std::uint8_t>(), 0U) << "a byte is left, but the earlier failure stays";
  EXPECT_EQ(in.position(), 7U);
  EXPECT_TRUE(in.take(SIZE_MAX).empty());
}

}  // namespace
}  // namespace prescene::interfaces
