// SPDX-License-Identifier: Apache-2.0
// Where library code puts what a person should read. Libraries never print: the service passes a sink in.
#pragma once

#include <functional>
#include <string>

namespace prescene::core {

enum class LogLevel { kDebug, kInfo, kWarning, kError };

/// May be called from any thread. An empty sink drops everything.
using LogSink = std::function<void(LogLevel level, const std::string& text)>;

inline void log(const LogSink& sink, LogLevel level, const std::string& text) {
  if (sink) sink(level, text);
}

}  // namespace prescene::core
