// SPDX-License-Identifier: Apache-2.0
#include "html_text.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/text.h"
#include "prescene/interfaces/images/png.h"

namespace prescene::interfaces {
namespace {

/// Length of the well-formed UTF-8 sequence that begins at `at`, 0 when there is none (Unicode standard, table 3-7).
std::size_t utf8_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0u; };
  const auto tail = [&](std::size_t i) { return byte(i) >= 0x80 && byte(i) <= 0xBF; };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return tail(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const unsigned low = first == 0xE0 ? 0xA0 : 0x80, high = first == 0xED ? 0x9F : 0xBF;
    return byte(1) >= low && byte(1) <= high && tail(2) ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const unsigned low = first == 0xF0 ? 0x90 : 0x80, high = first == 0xF4 ? 0x8F : 0xBF;
    return byte(1) >= low && byte(1) <= high && tail(2) && tail(3) ? 4 : 0;
  }
  return 0;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    if (length == 0) {
      out += "\xEF\xBF\xBD";
      ++i;
      continue;
    }
    const char c = text[i];
    if (length > 1) {
      // U+FFFE and U+FFFF are well-formed UTF-8 but no characters of a document.
      const std::string_view sequence = text.substr(i, length);
      out += sequence == "\xEF\xBF\xBE" || sequence == "\xEF\xBF\xBF" ? "\xEF\xBF\xBD" : sequence;
    } else if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else if (c == '\'') {
      out += "&#39;";
    } else if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7F) {
      out += c;
    } else if (c == '\n' || c == '\t') {
      out += c;
    }
    i += length;
  }
  return out;
}

std::string png_data_uri(const geometry::ColorImage& picture) {
  return "data:image/png;base64," + core::base64(encode_png(picture.view()));
}

std::string decimal(double value, int decimals) {
  return std::isfinite(value) ? core::fixed_text(value, decimals) : "–";
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return "–";
  if (value == 0.0) return "0";
  const int magnitude = static_cast<int>(std::floor(std::log10(std::abs(value))));
  return decimal(value, std::clamp(digits - 1 - magnitude, 0, 12));
}

std::string percent(double share) { return std::isfinite(share) ? decimal(100.0 * share, 1) + " %" : "–"; }

std::string hex(const geometry::Rgb& color) {
  static constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text = "#";
  for (const std::uint8_t channel : color) {
    text += kDigits[channel >> 4];
    text += kDigits[channel & 15];
  }
  return text;
}

}  // namespace prescene::interfaces
