// SPDX-License-Identifier: Apache-2.0
// Time. Nothing that is replayed reads a clock: durations measured here only go into reports.
#pragma once

#include <chrono>
#include <cmath>
#include <cstdint>

namespace prescene::core {

/// Nanoseconds since 1970-01-01 UTC, the unit of every message stamp.
using TimeNs = std::int64_t;

inline double seconds_of(TimeNs ns) { return static_cast<double>(ns) * 1e-9; }
inline TimeNs ns_of(double seconds) { return static_cast<TimeNs>(std::llround(seconds * 1e9)); }

/// Wall time now. It jumps when the system's clock is set: good for stamps, never for deadlines.
TimeNs wall_now_ns();

/// Wall time at the first call in this process, plus the steady time that has passed since. Never goes back and does
/// not follow the system's clock when that is set: for deadlines, and for the order in which messages came.
TimeNs steady_now_ns();

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
