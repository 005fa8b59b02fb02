// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/clock.h"

namespace prescene::core {

TimeNs wall_now_ns() {
  // system_clock counts from 1970-01-01 UTC since C++20.
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count();
}

}  // namespace prescene::core
