// SPDX-License-Identifier: Apache-2.0
// OpenGL without a window, through EGL's device or surfaceless platform; Mesa's software rasteriser will do.
#pragma once

#include <memory>

#include "prescene/core/status.h"
#include "prescene/rendering/gpu/graphics_devices.h"
#include "prescene/rendering/renderer.h"

namespace prescene::rendering {

/// Whether this build holds the backend.
bool egl_compiled_in();

/// A renderer with a context of its own. Fails with kUnavailable when no driver gives an OpenGL 3.3 context without a
/// display (the message names the Debian package to install), or when the build left EGL out; kInvalidInput for a
/// device that EGL does not list. Calls from several threads take turns.
///
/// Bits depend on the device and its driver. Away from silhouettes, depth is within 0.1 mm and 1e-4 of the depth of the
/// exact one (info().depth_tolerance; tests/rendering/renderer_contract_test.cc).
///
/// A context that is lost while it draws is made again, and the call with it; render() fails with kUnavailable when
/// that fails too, and the next call tries anew. It also fails with kUnsupported for a texture that is larger than the
/// device's.
core::Result<std::unique_ptr<Renderer>> make_egl_renderer(const DeviceChoice& choice = {});

}  // namespace prescene::rendering
