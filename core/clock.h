// SPDX-License-Identifier: Apache-2.0
// Time. Nothing that is replayed reads a clock: durations measured here only go into reports.
#pragma once

#include <chrono>
#include <cstdint>

namespace prescene::core {

/// Nanoseconds since 1970-01-01 UTC, the unit of every message stamp.
using TimeNs = std::int64_t;

inline double seconds_of(TimeNs ns) { return static_cast<double>(ns) * 1e-9; }

/// Wall time now.
TimeNs wall_now_ns();

/// Processor time of all threads of this process so far, s.
double process_cpu_seconds();

/// Seconds since its construction, from a monotonic clock.
class Stopwatch {
 public:
  Stopwatch() : start_(std::chrono::steady_clock::now()) {}
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  std::chrono::steady_clock::time_point start_;
};

}  // namespace prescene::core
