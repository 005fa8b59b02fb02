// SPDX-License-Identifier: Apache-2.0
#include "font_file.h"

// PRESCENE_FONT_FILE is the path of the font at build time.
asm(".section .rodata\n"
    "kPresceneFontBegin:\n"
    ".incbin \"" PRESCENE_FONT_FILE
    "\"\n"
    "kPresceneFontEnd:\n"
    ".byte 0\n"
    ".previous\n");

extern "C" const unsigned char kPresceneFontBegin[], kPresceneFontEnd[];

namespace prescene::interfaces {

std::span<const unsigned char> font_file() { return {kPresceneFontBegin, kPresceneFontEnd}; }

}  // namespace prescene::interfaces
