// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/thread_priority.h"

#include <sys/resource.h>
#include <unistd.h>

namespace prescene::core {

void lower_thread_priority() {
  constexpr int kNice = 10;
  const auto thread = static_cast<id_t>(gettid());
  if (getpriority(PRIO_PROCESS, thread) < kNice) static_cast<void>(setpriority(PRIO_PROCESS, thread, kNice));
}

}  // namespace prescene::core
