// SPDX-License-Identifier: Apache-2.0
// Text from outside, made fit to be shown: no control bytes or terminal escapes, never long.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace prescene::interfaces {

/// 'text' in single quotes: bytes outside printable ASCII as `\xNN`, quotes and backslashes escaped, "..." after
/// `max_characters` of the text.
std::string quote(std::string_view text, std::size_t max_characters = 64);

/// One line that any terminal shows: `\xNN` for each byte of control characters (U+0000 to U+001F, U+007F to U+009F)
/// and of what is not UTF-8; all else, backslashes too, as it is, of any length.
std::string printable(std::string_view text);
/// The same of a text of several lines: line ends and tabs stay.
std::string printable_lines(std::string_view text);

/// "3", "0.25", "1e-09": a short text that reads back as the same number; "nan", "inf", "-inf".
std::string number_text(double value);

/// "612 bytes", "1.5 MiB".
std::string size_text(std::size_t bytes);

/// Spaces, tabs and line ends removed at both ends.
std::string_view trimmed(std::string_view text);

/// The whole text as a number, or false: no surrounding space, no locale; "nan" and "inf" are numbers.
bool parse_number(std::string_view text, double* value);
/// The same, but nothing for "nan" and "inf" either.
std::optional<double> finite_number(std::string_view text);
/// The whole text as a decimal integer that fits, or false.
bool parse_integer(std::string_view text, long long* value);

}  // namespace prescene::interfaces
