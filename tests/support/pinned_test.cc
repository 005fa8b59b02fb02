// SPDX-License-Identifier: Apache-2.0
#include "prescene/tests/support/pinned.h"

#include <cstdlib>
#include <fstream>

#include "prescene/tests/support/paths.h"

namespace prescene::tests {
namespace {

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
  const auto result = matches_pinned("carton", trace_);
  EXPECT_FALSE(result);
  EXPECT_NE(std::string(result.message()).find("./dev bless"), std::string::npos);
}

TEST_F(Pinned, BlessingPinsWhatIsThenCompared) {
  setenv("PRESCENE_BLESS", "1", 1);
  EXPECT_TRUE(matches_pinned("carton", trace_));
  unsetenv("PRESCENE_BLESS");
  EXPECT_TRUE(matches_pinned("carton", trace_));
}

TEST_F(Pinned, TheFirstDifferenceIsNamedAndTheActualTraceKept) {
  setenv("PRESCENE_BLESS", "1", 1);
  ASSERT_TRUE(matches_pinned("carton", trace_));
  unsetenv("PRESCENE_BLESS");
  auto changed = trace_;
  changed[1].hash = 0x3ULL;
  const auto result = matches_pinned("carton", changed);
  EXPECT_FALSE(result);
  EXPECT_NE(
      std::string(result.message()).find("expected '0 predict 1 0000000000000001', got '0 predict 1 0000000000000003'"),
      std::string::npos)
      << result.message();
  EXPECT_TRUE(std::filesystem::exists(scratch_.path() / "traces" / "carton.trace"));
  const auto shorter = matches_pinned("carton", std::span(trace_).first(2));
  EXPECT_NE(std::string(shorter.message()).find("got 'the end'"), std::string::npos) << shorter.message();
}

}  // namespace
}  // namespace prescene::tests
