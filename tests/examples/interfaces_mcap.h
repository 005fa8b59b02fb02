// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/mcap take for granted.
#pragma once

#include <cstdint>
#include <vector>

namespace prescene::interfaces::given_interfaces_mcap {

extern const std::int64_t log_time_ns, publish_time_ns;
extern const std::vector<std::uint8_t> cdr;

}  // namespace prescene::interfaces::given_interfaces_mcap
