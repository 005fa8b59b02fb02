// SPDX-License-Identifier: Apache-2.0
// Whether bytes from outside are text. JSON, DDS strings and MCAP strings are UTF-8; programs that read ours (Python's
// above all) stop at bytes that are not.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

namespace prescene::core {

/// The first byte at which the text stops being UTF-8 [RFC 3629, section 4]: overlong forms, surrogates and code points
/// above U+10FFFF are none. Nothing where all of it is.
std::optional<std::size_t> not_utf8_at(std::string_view text);

/// Length of the well-formed sequence that begins at byte `i` (< text.size()), 1 to 4; 0 where none does.
std::size_t utf8_length_at(std::string_view text, std::size_t i);
/// The character that begins at byte `i` (< text.size()); U+FFFD where none does.
char32_t utf8_character_at(std::string_view text, std::size_t i);

inline bool is_utf8(std::string_view text) { return !not_utf8_at(text); }

}  // namespace prescene::core
