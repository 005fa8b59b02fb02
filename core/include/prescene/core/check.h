// SPDX-License-Identifier: Apache-2.0
// Checks for bugs of our own. What comes from outside (files, bus, settings) is never checked here: that is Status.
#pragma once

#include <string_view>

namespace prescene::core {

/// Writes "file:line: check failed: expression (message)" to stderr and aborts.
[[noreturn]] void check_failed(const char* file, int line, const char* expression, std::string_view message);

}  // namespace prescene::core

/// Always armed: aborts when `condition` is false, which means that our own code has a bug.
#define PRESCENE_CHECK(condition)                                         \
  do {                                                                    \
    if (!(condition)) [[unlikely]]                                        \
      ::prescene::core::check_failed(__FILE__, __LINE__, #condition, {}); \
  } while (false)

/// The same with a text that helps to find the bug.
#define PRESCENE_CHECK_MSG(condition, message)                                   \
  do {                                                                           \
    if (!(condition)) [[unlikely]]                                               \
      ::prescene::core::check_failed(__FILE__, __LINE__, #condition, (message)); \
  } while (false)

/// Armed in the checked, dev and sanitizer presets only (PRESCENE_DCHECKS=1), for checks on hot paths.
#if defined(PRESCENE_DCHECKS) && PRESCENE_DCHECKS
#define PRESCENE_DCHECK(condition) PRESCENE_CHECK(condition)
#else
#define PRESCENE_DCHECK(condition) static_cast<void>(sizeof(!(condition)))
#endif
