// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/status.h"

#include "prescene/core/check.h"

namespace prescene::core {

std::string_view to_string(StatusCode code) {
  switch (code) {
    case StatusCode::kOk:
      return "ok";
    case StatusCode::kInvalidInput:
      return "invalid input";
    case StatusCode::kNotFound:
      return "not found";
    case StatusCode::kDataLoss:
      return "data loss";
    case StatusCode::kUnsupported:
      return "unsupported";
    case StatusCode::kUnavailable:
      return "unavailable";
    case StatusCode::kResourceExhausted:
      return "resource exhausted";
    case StatusCode::kCancelled:
      return "cancelled";
  }
  check_failed(__FILE__, __LINE__, "a StatusCode outside of its enumeration", {});
}

Status Status::at(std::string_view place) const {
  if (ok()) return {};
  std::string text(place);
  if (!message_.empty()) text.append(": ").append(message_);
  return {code_, std::move(text)};
}

std::string to_string(const Status& status) {
  std::string text(to_string(status.code()));
  if (!status.message().empty()) text.append(": ").append(status.message());
  return text;
}

}  // namespace prescene::core
