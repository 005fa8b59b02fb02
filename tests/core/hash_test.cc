// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/hash.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <set>

#include "prescene/core/clock.h"

namespace prescene::core {
namespace {

TEST(Hasher, KeepsItsValues) {
  // Caches and pinned traces hold these: a change makes all of them worthless.
  EXPECT_EQ(hash_text(Hasher().digest()), "efd01f60ba992926");
  EXPECT_EQ(hash_text(Hasher().text("prescene").value(1.5).value(std::int32_t{-7}).digest()), "664455266f6ecc55");
}

TEST(Hasher, IsIncremental) {
  const std::array<unsigned char, 5> data = {1, 2, 3, 4, 5};
  EXPECT_EQ(Hasher().bytes(data.data(), 5).digest(), Hasher().bytes(data.data(), 2).bytes(data.data() + 2, 3).digest());
}

TEST(Hasher, IsAboutBits) {
  EXPECT_NE(Hasher().value(0.0).digest(), Hasher().value(-0.0).digest());
  EXPECT_NE(Hasher().value(1.0).digest(), Hasher().value(std::nextafter(1.0, 2.0)).digest());
}

TEST(Hasher, TextsDoNotRunTogether) {
  EXPECT_NE(Hasher().text("ab").text("c").digest(), Hasher().text("a").text("bc").digest());
  EXPECT_NE(Hasher().text("").text("a").digest(), Hasher().text("a").text("").digest());
}

TEST(Hasher, SmallNumbersDoNotCollide) {
  std::set<std::uint64_t> digests;
  for (std::uint32_t i = 0; i < 20000; ++i) digests.insert(Hasher().value(i).digest());
  EXPECT_EQ(digests.size(), 20000U);
}

TEST(Hasher, EachInputBitTurnsAboutHalfOfTheOutputBits) {
  // Over 256 inputs and their 64 neighbours by one bit each, each output bit turns 8192 times on average with a
  // standard deviation of 64; the bound is 6 deviations, one false alarm in 8 million runs of other constants.
  std::array<int, 64> turned{};
  for (std::uint64_t i = 0; i < 256; ++i) {
    const std::uint64_t input = i * 0x9e3779b97f4a7c15ULL;
    const std::uint64_t digest = Hasher().value(input).digest();
    for (int bit = 0; bit < 64; ++bit) {
      const std::uint64_t difference = digest ^ Hasher().value(input ^ (1ULL << bit)).digest();
      for (std::size_t out = 0; out < 64; ++out) turned[out] += static_cast<int>((difference >> out) & 1);
    }
  }
  for (const int count : turned) EXPECT_NEAR(count, 8192, 6 * 64);
}

TEST(HashText, HasSixteenDigits) {
  EXPECT_EQ(hash_text(0), "0000000000000000");
  EXPECT_EQ(hash_text(0x0123456789abcdefULL), "0123456789abcdef");
}

TEST(Clock, WallTimeIsInNanosecondsSince1970) {
  constexpr TimeNs kStartOf2020 = 1577836800LL * 1000000000;
  EXPECT_GT(wall_now_ns(), kStartOf2020);
  EXPECT_DOUBLE_EQ(seconds_of(1500000000), 1.5);
}

TEST(Clock, StopwatchNeverRunsBackwards) {
  const Stopwatch watch;
  const double first = watch.seconds();
  EXPECT_GE(first, 0.0);
  EXPECT_GE(watch.seconds(), first);
}

}  // namespace
}  // namespace prescene::core
