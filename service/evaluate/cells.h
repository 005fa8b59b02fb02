// SPDX-License-Identifier: Apache-2.0
// The cells of text tables that data sets bring.
#pragma once

#include <charconv>
#include <cmath>
#include <string_view>

namespace prescene::service {

/// Whether `text` is a finite number and nothing else; it is then `value`.
inline bool parse_cell(std::string_view text, double* value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(*value);
}

}  // namespace prescene::service
