// SPDX-License-Identifier: Apache-2.0
// What a piece of work costs one thread.
#pragma once

#include <sys/resource.h>

#include <algorithm>
#include <functional>

namespace prescene::benchmarks {

/// Processor seconds of this thread.
inline double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
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
