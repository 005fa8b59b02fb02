// SPDX-License-Identifier: Apache-2.0
// What a piece of work costs one thread.
#pragma once

#include <algorithm>
#include <ctime>
#include <functional>

namespace prescene::benchmarks {

/// Processor seconds of this thread.
inline double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Processor time of a call, s: the least of several rounds of at least a fifth of a second.
inline double cost_of(const std::function<void()>& work, int rounds) {
  work();
  double least = 1e30;
  for (int round = 0; round < rounds; ++round) {
    const double begin = processor_seconds();
    int calls = 0;
    double spent = 0.0;
    do {
      work();
      ++calls;
      spent = processor_seconds() - begin;
    } while (spent < 0.2);
    least = std::min(least, spent / calls);
  }
  return least;
}

}  // namespace prescene::benchmarks
