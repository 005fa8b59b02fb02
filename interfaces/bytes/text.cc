// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/bytes/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "prescene/core/utf8.h"

namespace prescene::interfaces {
namespace {

template <class Number>
bool parse_whole(std::string_view text, Number* value) {
  if (text.size() > 1 && text.front() == '+' && text[1] != '-' && text[1] != '+') text.remove_prefix(1);
  const std::from_chars_result result = std::from_chars(text.data(), text.data() + text.size(), *value);
  return result.ec == std::errc() && result.ptr == text.data() + text.size();
}

void append_escaped(std::string_view bytes, std::string& out) {
  constexpr const char* kDigits = "0123456789abcdef";
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    out += "\\x";
    out += kDigits[byte / 16];
    out += kDigits[byte % 16];
  }
}

/// C0, DEL, and C1, whose U+009B begins a command as the escape does.
bool is_control(char32_t character) { return character < 0x20 || (character >= 0x7f && character < 0xa0); }

/// Fit for a terminal; with `keeps_layout`, line ends and tabs stay.
std::string without_controls(std::string_view text, bool keeps_layout) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = core::utf8_length_at(text, i);
    const std::string_view character = text.substr(i, std::max<std::size_t>(length, 1));
    const bool is_layout = keeps_layout && (text[i] == '\n' || text[i] == '\t');
    if (length == 0 || (is_control(core::utf8_character_at(text, i)) && !is_layout))
      append_escaped(character, out);
    else
      out += character;
    i += character.size();
  }
  return out;
}

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v'; }

}  // namespace

std::string quote(std::string_view text, std::size_t max_characters) {
  std::string out = "'";
  for (const char& c : text.substr(0, max_characters)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\'' || c == '\\') {
      out += '\\';
      out += c;
    } else if (byte < 0x20 || byte >= 0x7f) {
      append_escaped({&c, 1}, out);
    } else {
      out += c;
    }
  }
  out += text.size() > max_characters ? "...'" : "'";
  return out;
}

std::string printable(std::string_view text) { return without_controls(text, false); }
std::string printable_lines(std::string_view text) { return without_controls(text, true); }

std::string number_text(double value) {
  // Shortest text would write 200000 as 2e+05, which people read less easily.
  const bool fixed = value == 0.0 || (std::abs(value) >= 1e-4 && std::abs(value) < 1e15);
  std::array<char, 40> buffer{};
  const std::to_chars_result result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                                    fixed ? std::chars_format::fixed : std::chars_format::scientific);
  return {buffer.data(), result.ptr};
}

std::string size_text(std::size_t bytes) {
  if (bytes < 10240) return std::to_string(bytes) + (bytes == 1 ? " byte" : " bytes");
  static constexpr std::array<const char*, 4> kUnits = {"KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes) / 1024.0;
  std::size_t unit = 0;
  while (value >= 1024.0 && unit + 1 < kUnits.size()) {
    value /= 1024.0;
    ++unit;
  }
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.1f %s", value, kUnits[unit]);
  return buffer.data();
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

bool parse_number(std::string_view text, double* value) { return parse_whole(text, value); }
std::optional<double> finite_number(std::string_view text) {
  double value = 0.0;
  return parse_number(text, &value) && std::isfinite(value) ? std::optional(value) : std::nullopt;
}
bool parse_integer(std::string_view text, long long* value) { return parse_whole(text, value); }

}  // namespace prescene::interfaces
