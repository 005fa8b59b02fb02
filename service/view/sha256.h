// SPDX-License-Identifier: Apache-2.0
// SHA-256 [FIPS 180-4]: a policy names the one script that a document runs by it.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace prescene::service {

std::array<std::uint8_t, 32> sha256(std::string_view text);

}  // namespace prescene::service
