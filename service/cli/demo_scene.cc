// SPDX-License-Identifier: Apache-2.0
#include "demo_scene.h"

// PRESCENE_DEMO_SCENE is the path of the scene at build time.
asm(".section .rodata\n"
    "kPresceneDemoSceneBegin:\n"
    ".incbin \"" PRESCENE_DEMO_SCENE
    "\"\n"
    "kPresceneDemoSceneEnd:\n"
    ".byte 0\n"
    ".previous\n");

extern "C" const char kPresceneDemoSceneBegin[], kPresceneDemoSceneEnd[];

namespace prescene::service {

std::string_view demo_scene() { return {kPresceneDemoSceneBegin, kPresceneDemoSceneEnd}; }

}  // namespace prescene::service
