// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/thread_priority.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

namespace prescene::core {
namespace {

int nice_of_this_thread() { return getpriority(PRIO_PROCESS, static_cast<id_t>(gettid())); }

TEST(ThreadPriority, IsLoweredOfTheCallingThreadAlone) {
  const int before = nice_of_this_thread();
  int of_other = before;
  std::thread other([&] {
    lower_thread_priority();
    of_other = nice_of_this_thread();
  });
  other.join();
  EXPECT_EQ(of_other, std::max(before, 10));
  EXPECT_EQ(nice_of_this_thread(), before);
}

}  // namespace
}  // namespace prescene::core
