// SPDX-License-Identifier: Apache-2.0
// What goes on where a library throws, as there is no memory.
#pragma once

#include <exception>
#include <new>
#include <string>

#include "prescene/core/status.h"

namespace prescene::service {

/// Why the exception that is caught was thrown, in words that need no memory where there is none.
inline core::Status status_of_exception() noexcept {
  try {
    throw;
  } catch (const std::bad_alloc&) {
  } catch (const std::exception& error) {
    try {
      return core::unavailable(error.what());
    } catch (const std::bad_alloc&) {
    }
  } catch (...) {
    return core::Status(core::StatusCode::kUnavailable, "not known why");
  }
  return core::Status(core::StatusCode::kResourceExhausted, "out of memory");
}

/// What a job gives, also where it ends in an exception.
template <class Result, class Job>
Result result_of(const Job& job) noexcept {
  try {
    return job();
  } catch (...) {
    return status_of_exception();
  }
}

/// A copy, or words that need no memory where there is none.
inline void assign(const std::string& text, std::string& to) noexcept {
  try {
    to = text;
  } catch (const std::bad_alloc&) {
    to = "out of memory";
  }
}

}  // namespace prescene::service
