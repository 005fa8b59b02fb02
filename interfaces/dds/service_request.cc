// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/dds/service_request.h"

#include <utility>
#include <vector>

#include "prescene/interfaces/ros_messages/cdr.h"

namespace prescene::interfaces {

std::optional<ServiceRequest> parse_request(std::span<const std::uint8_t> cdr, ServiceForm form) {
  constexpr std::size_t kHeader = 4, kIdentity = 16, kLongest = std::size_t{4} << 20;
  if (cdr.size() < kHeader + kIdentity || cdr.size() > kLongest || cdr[0] != 0 || cdr[1] > 1) return std::nullopt;
  const bool is_little = cdr[1] == 1;
  const auto number_at = [&](std::size_t at) {
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < 8; ++i) number = number << 8 | cdr[at + (is_little ? 7 - i : i)];
    return number;
  };
  ServiceRequest request;
  request.client = number_at(kHeader);
  request.sequence = static_cast<std::int64_t>(number_at(kHeader + 8));
  if (form == ServiceForm::kEmpty) return request;
  // The fields are aligned to 16 bytes, so that they are a message of their own.
  std::vector<std::uint8_t> body(cdr.begin(), cdr.begin() + kHeader);
  body.insert(body.end(), cdr.begin() + kHeader + kIdentity, cdr.end());
  if (form == ServiceForm::kFields) {
    request.fields = std::move(body);
    return request;
  }
  auto text = decode_cdr<RosString>(body, kSmallMessage);
  if (!text) return std::nullopt;
  request.text = std::move(text->data);
  return request;
}

}  // namespace prescene::interfaces
