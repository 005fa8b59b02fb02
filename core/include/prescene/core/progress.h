// SPDX-License-Identifier: Apache-2.0
// Progress and cancellation of long work.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <string>

namespace prescene::core {

/// How far a piece of work is.
struct Progress {
  double fraction = 0.0;               ///< In [0, 1].
  std::optional<double> seconds_left;  ///< Estimate; empty while there is none.
  std::string text;                    ///< What is being done, for a person.
};

/// Called from the thread that does the work, at most some times a second by convention of the caller.
using ProgressSink = std::function<void(const Progress&)>;

/// A flag that a signal handler or another thread sets; long work looks at it between steps and returns
/// what is done so far, or Status kCancelled.
class Cancellation {
 public:
  using Clock = std::chrono::steady_clock;

  Cancellation() = default;
  /// Requested too when `outer` is, which must outlive this one, and from `deadline` on.
  Cancellation(const Cancellation& outer, Clock::time_point deadline) : outer_(&outer), deadline_(deadline) {}

  void request() { requested_.store(true, std::memory_order_relaxed); }
  bool requested() const {
    return requested_.load(std::memory_order_relaxed) || (outer_ && outer_->requested()) ||
           (deadline_ && Clock::now() >= *deadline_);
  }

 private:
  std::atomic<bool> requested_{false};
  const Cancellation* outer_ = nullptr;
  std::optional<Clock::time_point> deadline_;
};

}  // namespace prescene::core
