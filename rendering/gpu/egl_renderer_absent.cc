// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/gpu/egl_renderer.h"

namespace prescene::rendering {

bool egl_compiled_in() { return false; }

std::vector<GraphicsDevice> graphics_devices() { return {}; }

core::Result<std::unique_ptr<Renderer>> make_egl_renderer(const DeviceChoice& /*choice*/) {
  return core::unavailable(
      "OpenGL renderer: this build left it out: configure with -DPRESCENE_EGL=ON (needs libegl-dev and libopengl-dev), "
      "or "
      "use the reference renderer");
}

}  // namespace prescene::rendering
