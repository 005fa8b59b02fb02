// SPDX-License-Identifier: Apache-2.0
// The readable backend: a z-buffer on the processor, image by image, that the fast ones are tested against.
#pragma once

#include <memory>

#include "prescene/rendering/renderer.h"

namespace prescene::rendering {

/// Deterministic bits; works in parallel when called from several threads.
std::unique_ptr<Renderer> make_reference_renderer();

}  // namespace prescene::rendering
