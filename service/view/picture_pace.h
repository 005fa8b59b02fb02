// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace prescene::service {

/// How large pictures are that the page gets.
inline constexpr int kPictureWidth = 960, kPictureQuality = 80;
inline constexpr int kStripWidth = 96, kStripQuality = 60;

/// True at most so often.
class Pace {
 public:
  explicit Pace(double per_second)
      : interval_(
            std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(1.0 / per_second))) {}
  bool due() {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return false;
    next_ = now + interval_;
    return true;
  }

 private:
  std::chrono::nanoseconds interval_;
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace prescene::service
