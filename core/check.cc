// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/check.h"

#include <cstdio>
#include <cstdlib>

namespace prescene::core {

void check_failed(const char* file, int line, const char* expression, std::string_view message) {
  std::fprintf(stderr, "%s:%d: check failed: %s", file, line, expression);
  if (!message.empty()) std::fprintf(stderr, " (%.*s)", static_cast<int>(message.size()), message.data());
  std::fputc('\n', stderr);
  std::fflush(stderr);
  std::abort();
}

}  // namespace prescene::core
