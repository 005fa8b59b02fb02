// SPDX-License-Identifier: Apache-2.0
// Keeps the log of a program that runs for days readable: a fault that repeats with every message is logged once in a
// while, with a count of what was left out, and a long text is shortened.
//
//   LogLimiter limiter(log, {});
//   core::log(limiter.sink(), core::LogLevel::kWarning, "the same fault as a moment ago");
//   if (!limiter.log(core::LogLevel::kWarning, "no frames come")) ...
//   ... limiter.held_back()
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "prescene/core/log.h"

namespace prescene::service {

struct LogLimit {
  double lines_per_second = 0.5;     ///< In the long run.
  int burst = 20;                    ///< Lines at once after a quiet time.
  int for_errors = 5;                ///< Of these, so many are kept for errors: a flood of warnings holds none back.
  double repeat_after_s = 30.0;      ///< The same text is not logged again before.
  std::size_t longest_line = 1'000;  ///< Bytes; the rest of a line is cut off.
};

/// Thread-safe. Debug and info lines are limited as warnings and errors are.
class LogLimiter {
 public:
  /// `now_s` gives a time in seconds that never goes back; empty = the steady clock.
  LogLimiter(core::LogSink log, const LogLimit& limit, std::function<double()> now_s = {});
  /// Logs how many lines were held back since the last one that passed, if any.
  ~LogLimiter();
  LogLimiter(const LogLimiter&) = delete;
  LogLimiter& operator=(const LogLimiter&) = delete;

  /// Logs a line, or holds it back and counts it; true where it was logged.
  bool log(core::LogLevel level, const std::string& text);
  /// Logs a text once in the limiter's life, as soon as a call of this finds that it may be logged. Of such texts 32 at
  /// most.
  void log_once(core::LogLevel level, const std::string& text);
  /// log() as a sink. Must not outlive the limiter.
  core::LogSink sink();
  /// Lines that were not logged, since the start.
  std::uint64_t held_back() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace prescene::service
