// SPDX-License-Identifier: Apache-2.0
// Text and numbers as HTML and SVG want them.
#pragma once

#include <string>
#include <string_view>

#include "prescene/geometry/image.h"

namespace prescene::interfaces {

/// Fit for element content and quoted attributes: & < > " ' escaped, control bytes dropped (line ends and tabs stay),
/// bytes that are not UTF-8 replaced by U+FFFD.
std::string escaped(std::string_view text);
/// "data:image/png;base64,..." of the picture, which must not be empty.
std::string png_data_uri(const geometry::ColorImage& picture);
/// core::fixed_text, with "–" for what is not finite.
std::string decimal(double value, int decimals);
/// With about so many significant digits: 0.0123, 12.3, 4560.
std::string significant(double value, int digits);
/// "62.3 %".
std::string percent(double share);
/// "#rrggbb".
std::string hex(const geometry::Rgb& color);

}  // namespace prescene::interfaces
