// SPDX-License-Identifier: Apache-2.0
#include "font_file.h"

// PRESCENE_FONT_FILE is the path of the font at build time.
asm(".section .rodata\n"
    "prescene_font_begin:\n"
    ".incbin \"" PRESCENE_FONT_FILE
    "\"\n"
    "prescene_font_end:\n"
    ".byte 0\n"
    ".previous\n");

extern "C" const unsigned char prescene_font_begin[], prescene_font_end[];

namespace prescene::interfaces {

std::span<const unsigned char> font_file() { return {prescene_font_begin, prescene_font_end}; }

}  // namespace prescene::interfaces
