// SPDX-License-Identifier: Apache-2.0
// The font of the lettering, DejaVu Sans of the package fonts-dejavu-core, as the build put it into the program: what
// is drawn needs no file at run time.
#pragma once

#include <span>

namespace prescene::interfaces {

/// The bytes of its TrueType file.
std::span<const unsigned char> font_file();

}  // namespace prescene::interfaces
