// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/log_limiter.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "prescene/core/clock.h"

namespace prescene::service {

struct LogLimiter::State {
  core::LogSink log;
  LogLimit limit;
  std::function<double()> now_s;

  std::mutex mutex;  // guards what follows
  double tokens = 0.0;
  double refilled_s = 0.0;
  std::deque<std::pair<double, std::string>> recent;  // lines that passed, oldest first
  std::uint64_t held_back = 0;
  std::uint64_t reported = 0;  // of them, those that a later line told of
  std::set<std::string> once;  // texts of log_once() that passed

  /// Whether the line may pass; takes a token for it.
  bool admit(core::LogLevel level, const std::string& text) {
    const double now = now_s();
    tokens = std::min<double>(limit.burst, tokens + (now - refilled_s) * limit.lines_per_second);
    refilled_s = now;
    while (!recent.empty() && recent.front().first + limit.repeat_after_s <= now) recent.pop_front();
    const bool repeats =
        std::any_of(recent.begin(), recent.end(), [&](const auto& entry) { return entry.second == text; });
    const double kept = level == core::LogLevel::kError ? 0.0 : std::min(limit.for_errors, limit.burst - 1);
    if (repeats || tokens < kept + 1.0) return false;
    tokens -= 1.0;
    recent.emplace_back(now, text);
    return true;
  }

  bool pass(core::LogLevel level, const std::string& raw) {
    std::string text = raw.size() <= limit.longest_line ? raw : raw.substr(0, limit.longest_line) + " ...";
    {
      const std::lock_guard lock(mutex);
      if (!admit(level, text)) {
        ++held_back;
        return false;
      }
      if (const std::uint64_t since = held_back - std::exchange(reported, held_back); since > 0) {
        text += " (" + std::to_string(since) + " lines were not logged before this one)";
      }
    }
    core::log(log, level, text);
    return true;
  }
};

LogLimiter::LogLimiter(core::LogSink log, const LogLimit& limit, std::function<double()> now_s)
    : state_(std::make_unique<State>()) {
  state_->log = std::move(log);
  state_->limit = limit;
  state_->now_s = now_s ? std::move(now_s) : [watch = core::Stopwatch()] { return watch.seconds(); };
  state_->tokens = limit.burst;
  state_->refilled_s = state_->now_s();
}

LogLimiter::~LogLimiter() {
  const std::uint64_t since = state_->held_back - state_->reported;
  if (since > 0) core::log(state_->log, core::LogLevel::kInfo, std::to_string(since) + " more lines were not logged");
}

bool LogLimiter::log(core::LogLevel level, const std::string& text) { return state_->pass(level, text); }

void LogLimiter::log_once(core::LogLevel level, const std::string& text) {
  // Such texts name what a scene holds, so they are few.
  constexpr std::size_t kMostOnce = 32;
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->once.size() >= kMostOnce || state_->once.contains(text)) return;
  }
  if (!state_->pass(level, text)) return;
  const std::lock_guard lock(state_->mutex);
  state_->once.insert(text);
}

core::LogSink LogLimiter::sink() {
  return [state = state_.get()](core::LogLevel level, const std::string& text) { state->pass(level, text); };
}

std::uint64_t LogLimiter::held_back() const {
  const std::lock_guard lock(state_->mutex);
  return state_->held_back;
}

}  // namespace prescene::service
