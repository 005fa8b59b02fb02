// SPDX-License-Identifier: Apache-2.0
// Numbers and bytes as text, the same in every locale.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace prescene::core {

/// "0.1235" with so many digits after the point, never "-0.00"; "nan", "inf", "-inf".
std::string fixed_text(double value, int decimals);

/// At most six significant digits: "0.00115", "1e-09", "nan".
std::string rounded_text(double value);

/// Base64 with padding [RFC 4648, section 4].
std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace prescene::core
