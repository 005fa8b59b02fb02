// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/log_limiter.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

namespace prescene::service {
namespace {

using ::testing::ElementsAre;

class LogLimiterTest : public ::testing::Test {
 protected:
  core::LogSink collect() {
    return [this](core::LogLevel, const std::string& text) { lines_.push_back(text); };
  }
  std::size_t bytes() const {
    std::size_t sum = 0;
    for (const std::string& line : lines_) sum += line.size();
    return sum;
  }

  double now_s_ = 0.0;
  std::vector<std::string> lines_;
};

TEST_F(LogLimiterTest, ALineIsRepeatedOnlyAfterAWhileWithTheCountOfWhatWasLeftOut) {
  LogLimiter limiter(collect(), {.repeat_after_s = 10.0}, [&] { return now_s_; });
  const core::LogSink log = limiter.sink();
  for (int i = 0; i < 100; ++i) log(core::LogLevel::kWarning, i % 2 == 0 ? "one" : "two");
  EXPECT_THAT(lines_, ElementsAre("one", "two"));
  EXPECT_EQ(limiter.held_back(), 98u);
  now_s_ = 10.0;
  log(core::LogLevel::kWarning, "one");
  EXPECT_EQ(lines_.back(), "one (98 lines were not logged before this one)");
  now_s_ = 20.0;
  log(core::LogLevel::kWarning, "one");
  EXPECT_EQ(lines_.back(), "one") << "a count is given once";
}

TEST_F(LogLimiterTest, AFloodOfWarningsHoldsNoErrorBack) {
  LogLimiter limiter(collect(), {.burst = 20, .for_errors = 5}, [&] { return now_s_; });
  for (int i = 0; i < 1000; ++i) limiter.log(core::LogLevel::kWarning, "warning " + std::to_string(i));
  EXPECT_EQ(lines_.size(), 15u);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(limiter.log(core::LogLevel::kError, "error " + std::to_string(i)));
  EXPECT_FALSE(limiter.log(core::LogLevel::kError, "one too many"));
  // What time brings is for errors first.
  now_s_ = 4.0;
  EXPECT_FALSE(limiter.log(core::LogLevel::kWarning, "warning"));
  EXPECT_TRUE(limiter.log(core::LogLevel::kError, "one more"));
}

TEST_F(LogLimiterTest, WhatIsToBeSaidOnceIsSaidWhenItMayBe) {
  LogLimiter limiter(collect(), {}, [&] { return now_s_; });
  int i = 0;
  while (limiter.log(core::LogLevel::kWarning, "warning " + std::to_string(i))) ++i;
  limiter.log_once(core::LogLevel::kWarning, "physics failed");
  EXPECT_THAT(lines_, ::testing::Not(::testing::Contains(::testing::StartsWith("physics failed"))));
  for (now_s_ = 10.0; now_s_ < 1000.0; now_s_ += 10.0) limiter.log_once(core::LogLevel::kWarning, "physics failed");
  EXPECT_EQ(std::count_if(lines_.begin(), lines_.end(),
                          [](const std::string& line) { return line.starts_with("physics failed"); }),
            1);
}

TEST_F(LogLimiterTest, ManyDifferentLinesAreBoundedInNumberAndLength) {
  {
    LogLimiter limiter(collect(), {.lines_per_second = 0.5, .burst = 20, .longest_line = 100}, [&] { return now_s_; });
    const core::LogSink log = limiter.sink();
    constexpr int kLines = 30'000;
    for (int i = 0; i < kLines; ++i) {
      now_s_ = 30.0 * i / kLines;
      log(core::LogLevel::kError, std::to_string(i) + std::string(50'000, 'x'));
    }
    EXPECT_GE(lines_.size(), 20u + 14u);
    EXPECT_LE(lines_.size(), 20u + 15u);
    EXPECT_LT(bytes(), lines_.size() * 200u);
    EXPECT_EQ(limiter.held_back() + lines_.size(), static_cast<std::uint64_t>(kLines));
  }
  EXPECT_THAT(lines_.back(), ::testing::EndsWith(" more lines were not logged"));
}

}  // namespace
}  // namespace prescene::service
