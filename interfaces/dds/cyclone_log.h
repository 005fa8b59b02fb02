// SPDX-License-Identifier: Apache-2.0
// What Cyclone DDS says, as lines of our log: by itself it prints to stderr, as often as a peer makes it.
#pragma once

#include "prescene/core/log.h"

namespace prescene::interfaces {

/// While it lives, what Cyclone says of a domain goes to `log`. Of several in a domain the oldest gets it; what is
/// about another domain, or none, goes to the oldest of all. An empty `log` gets nothing: where there are only such,
/// Cyclone prints. The line of a fatal error is printed, too. A sink must not make or end another one.
class CycloneLog {
 public:
  CycloneLog(int domain, core::LogSink log);
  ~CycloneLog();
  CycloneLog(const CycloneLog&) = delete;
  CycloneLog& operator=(const CycloneLog&) = delete;
};

}  // namespace prescene::interfaces
