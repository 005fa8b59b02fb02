// SPDX-License-Identifier: Apache-2.0
// SHA-256 [FIPS 180-4], to work out ROS 2's type hashes anew.
#pragma once

#include <string>
#include <string_view>

namespace prescene::tests {

/// 64 lower-case hexadecimal digits.
std::string sha256(std::string_view text);

}  // namespace prescene::tests
