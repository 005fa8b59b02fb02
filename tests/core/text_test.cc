// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/text.h"

#include <gtest/gtest.h>

#include <limits>
#include <string_view>

namespace prescene::core {
namespace {

std::string base64_of(std::string_view text) {
  return base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(FixedText, RoundsToSoManyDecimals) {
  EXPECT_EQ(fixed_text(0.12345, 4), "0.1235");  // The double lies above the tie.
  EXPECT_EQ(fixed_text(-2.5, 1), "-2.5");
  EXPECT_EQ(fixed_text(1234567.0, 0), "1234567");
  EXPECT_EQ(fixed_text(9.96, 1), "10.0");
}

TEST(FixedText, HasNoNegativeZero) {
  EXPECT_EQ(fixed_text(-0.0, 2), "0.00");
  EXPECT_EQ(fixed_text(-0.004, 2), "0.00");
  EXPECT_EQ(fixed_text(-0.4, 0), "0");
  EXPECT_EQ(fixed_text(-0.006, 2), "-0.01");
}

TEST(FixedText, TakesEveryDouble) {
  EXPECT_EQ(fixed_text(std::numeric_limits<double>::quiet_NaN(), 2), "nan");
  EXPECT_EQ(fixed_text(-std::numeric_limits<double>::infinity(), 2), "-inf");
  EXPECT_EQ(fixed_text(std::numeric_limits<double>::max(), 12).size(), 309u + 1u + 12u);
}

TEST(RoundedText, HasSixDigitsAtMost) {
  EXPECT_EQ(rounded_text(0.001154999999), "0.001155");
  EXPECT_EQ(rounded_text(250.0), "250");
  EXPECT_EQ(rounded_text(1e-9), "1e-09");
  EXPECT_EQ(rounded_text(std::numeric_limits<double>::infinity()), "inf");
}

TEST(Base64, EqualsTheVectorsOfRfc4648) {
  EXPECT_EQ(base64_of(""), "");
  EXPECT_EQ(base64_of("f"), "Zg==");
  EXPECT_EQ(base64_of("fo"), "Zm8=");
  EXPECT_EQ(base64_of("foo"), "Zm9v");
  EXPECT_EQ(base64_of("foob"), "Zm9vYg==");
  EXPECT_EQ(base64_of("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64_of("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64_of("\xff\xfe\x3e"), "//4+");
}

}  // namespace
}  // namespace prescene::core
