// SPDX-License-Identifier: Apache-2.0
#include "html_text.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/text.h"
#include "prescene/core/utf8.h"
#include "prescene/interfaces/images/png.h"

namespace prescene::interfaces {

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = core::utf8_length_at(text, i);
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
