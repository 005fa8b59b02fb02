// SPDX-License-Identifier: Apache-2.0
#include "tests/support/pinned.h"

#include <cstdlib>
#include <fstream>
#include <limits>

#include "tests/support/paths.h"

namespace prescene::tests {
namespace {

constexpr const char* kPlatform = "compiler 1; library 2";

// Points the checkout and the build folder at a scratch folder for one test.
class Pinned : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* variable : {"PRESCENE_SOURCE_DIR", "PRESCENE_BUILD_DIR"}) {
      setenv(variable, scratch_.path().c_str(), 1);
    }
    unsetenv("PRESCENE_BLESS");
  }
  void TearDown() override {
    for (const char* variable : {"PRESCENE_SOURCE_DIR", "PRESCENE_BUILD_DIR", "PRESCENE_BLESS"}) unsetenv(variable);
  }

  ScratchDir scratch_;
  const std::vector<TraceEntry> trace_ = {
      {0, "predict", 0, 0xabcULL}, {0, "predict", 1, 0x1ULL}, {0, "weight", 0, 0x2ULL}};
};

TEST_F(Pinned, ATraceIsOneLineAnEntry) {
  EXPECT_EQ(trace_text(std::span(trace_).first(2)), "0 predict 0 0000000000000abc\n0 predict 1 0000000000000001\n");
}

TEST_F(Pinned, NothingPinnedFailsAndNamesTheRemedy) {
  const auto result = matches_pinned("carton", kPlatform, trace_);
  EXPECT_FALSE(result);
  EXPECT_NE(std::string(result.message()).find("./dev bless"), std::string::npos);
}

TEST_F(Pinned, BlessingPinsWhatIsThenCompared) {
  setenv("PRESCENE_BLESS", "1", 1);
  EXPECT_TRUE(matches_pinned("carton", kPlatform, trace_));
  unsetenv("PRESCENE_BLESS");
  EXPECT_TRUE(matches_pinned("carton", kPlatform, trace_));
}

TEST_F(Pinned, TheFirstDifferenceIsNamedAndTheActualTraceKept) {
  setenv("PRESCENE_BLESS", "1", 1);
  ASSERT_TRUE(matches_pinned("carton", kPlatform, trace_));
  unsetenv("PRESCENE_BLESS");
  auto changed = trace_;
  changed[1].hash = 0x3ULL;
  const auto result = matches_pinned("carton", kPlatform, changed);
  EXPECT_FALSE(result);
  EXPECT_NE(
      std::string(result.message()).find("expected '0 predict 1 0000000000000001', got '0 predict 1 0000000000000003'"),
      std::string::npos)
      << result.message();
  EXPECT_TRUE(std::filesystem::exists(scratch_.path() / "traces" / "carton.trace"));
  const auto shorter = matches_pinned("carton", kPlatform, std::span(trace_).first(2));
  EXPECT_NE(std::string(shorter.message()).find("got 'the end'"), std::string::npos) << shorter.message();
}

TEST_F(Pinned, BitsOfAnotherPlatformAreNotCompared) {
  setenv("PRESCENE_BLESS", "1", 1);
  ASSERT_TRUE(matches_pinned("carton", kPlatform, trace_));
  unsetenv("PRESCENE_BLESS");
  const auto result = matches_pinned("carton", "compiler 1; library 3", std::span(trace_).first(1));
  EXPECT_TRUE(result);
  EXPECT_NE(std::string(result.message()).find("not compared"), std::string::npos) << result.message();
}

TEST_F(Pinned, NumbersAreComparedWithinTheirTolerances) {
  const std::vector<ReadableNumber> numbers = {{"x, m", 0.1234567, 0.01}, {"share", 0.5, 0.02}};
  EXPECT_FALSE(matches_pinned("carton", numbers));
  setenv("PRESCENE_BLESS", "1", 1);
  ASSERT_TRUE(matches_pinned("carton", numbers));
  unsetenv("PRESCENE_BLESS");
  EXPECT_TRUE(matches_pinned("carton", numbers));

  auto changed = numbers;
  changed[0].value = 0.131;
  EXPECT_TRUE(matches_pinned("carton", changed));
  changed[0].value = 0.1345;
  const auto result = matches_pinned("carton", changed);
  EXPECT_FALSE(result);
  EXPECT_NE(std::string(result.message()).find("x, m: 0.1345"), std::string::npos) << result.message();
  EXPECT_EQ(std::string(result.message()).find("share"), std::string::npos) << result.message();
}

TEST_F(Pinned, NumbersThatComeGoOrAreNotNumbersAreNamed) {
  const std::vector<ReadableNumber> numbers = {{"x, m", 0.1, 0.01}, {"y, m", 0.2, 0.01}};
  setenv("PRESCENE_BLESS", "1", 1);
  ASSERT_TRUE(matches_pinned("carton", numbers));
  unsetenv("PRESCENE_BLESS");
  EXPECT_FALSE(matches_pinned("carton", std::span(numbers).first(1)));
  auto changed = numbers;
  changed[1].name = "z, m";
  EXPECT_FALSE(matches_pinned("carton", changed));
  changed = numbers;
  changed[1].tolerance = 0.1;  // a tolerance is not loosened in passing
  EXPECT_FALSE(matches_pinned("carton", changed));
  changed = numbers;
  changed[1].value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(matches_pinned("carton", changed));
  setenv("PRESCENE_BLESS", "1", 1);
  EXPECT_FALSE(matches_pinned("carton", changed)) << "not a number, whoever blesses it";
}

TEST_F(Pinned, BlessingKeepsNumbersThatStillFit) {
  setenv("PRESCENE_BLESS", "1", 1);
  ASSERT_TRUE(matches_pinned("carton", std::vector<ReadableNumber>{{"x", 0.100, 0.01}, {"y", 0.2, 0.01}}));
  ASSERT_TRUE(matches_pinned("carton", std::vector<ReadableNumber>{{"x", 0.109, 0.01}, {"y", 0.3, 0.01}}));
  unsetenv("PRESCENE_BLESS");
  EXPECT_TRUE(matches_pinned("carton", std::vector<ReadableNumber>{{"x", 0.091, 0.01}, {"y", 0.3, 0.01}}));
  EXPECT_FALSE(matches_pinned("carton", std::vector<ReadableNumber>{{"x", 0.118, 0.01}, {"y", 0.3, 0.01}}));
}

}  // namespace
}  // namespace prescene::tests
