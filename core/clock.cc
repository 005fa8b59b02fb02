// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/clock.h"

#include <ctime>

namespace prescene::core {

TimeNs wall_now_ns() {
  // system_clock counts from 1970-01-01 UTC since C++20.
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count();
}

TimeNs steady_now_ns() {
  using std::chrono::steady_clock;
  struct Start {
    TimeNs wall_ns = wall_now_ns();
    steady_clock::time_point steady = steady_clock::now();
  };
  static const Start kStart;
  return kStart.wall_ns +
         std::chrono::duration_cast<std::chrono::nanoseconds>(steady_clock::now() - kStart.steady).count();
}

double process_cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace prescene::core
