// SPDX-License-Identifier: Apache-2.0
// What the outside did wrong, and what libraries have to say, on their way to Python.
#pragma once

#include <pybind11/pybind11.h>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "prescene/core/log.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::python {

/// Text for Python; bytes that are not UTF-8, as in the name of a file, become U+FFFD.
pybind11::str python_text(std::string_view text);

/// Throws the exception of prescene.errors that belongs to the code. `status` is not ok; `report`: what is wrong in a
/// file, one by one.
[[noreturn]] void raise(const core::Status& status, const interfaces::FileReport& report = {});
/// The same of what an argument of a call did wrong.
[[noreturn]] void raise_input(const std::string& message);

inline void raise_if_error(const core::Status& status) {
  if (!status.ok()) raise(status);
}
template <class T>
T value_or_raise(core::Result<T> result) {
  if (!result) raise(result.status());
  return *std::move(result);
}

/// Keeps what is logged, from any thread, until the GIL is held to hand it to Python's logger "prescene".
class KeptLog {
 public:
  core::LogSink sink();
  /// With the GIL. What a handler of the logger raises is thrown.
  void hand_over();

 private:
  std::mutex mutex_;
  std::vector<std::pair<core::LogLevel, std::string>> lines_;
};

}  // namespace prescene::python
