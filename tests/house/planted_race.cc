// SPDX-License-Identifier: Apache-2.0
// A loop body with a race on purpose: the thread sanitizer must report it, through the same ThreadPool that every
// module uses and with the suppressions of every other test.
#include <cstdio>

#include "prescene/core/parallel.h"

int main() {
  long sum = 0;
  prescene::core::ThreadPool pool(4);
  pool.for_blocks(100000, 1, [&](std::size_t begin, std::size_t) { sum += static_cast<long>(begin); });
  std::printf("%ld\n", sum);
}
