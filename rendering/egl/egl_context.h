// SPDX-License-Identifier: Apache-2.0
// An OpenGL 3.3 context without window or display, and turns at using it.
#pragma once

#include <EGL/egl.h>

#include <memory>
#include <mutex>
#include <string>

#include "prescene/core/status.h"

namespace prescene::rendering {

/// Owns one context. The EGL display that it came from stays initialised until the program ends: it belongs to the
/// whole process, and closing it would take it from everybody else.
class EglContext {
 public:
  /// The first EGL device that gives such a context, graphics cards before software; else Mesa's surfaceless platform.
  static core::Result<std::unique_ptr<EglContext>> make();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// While it lives, the context is current on this thread and on no other; then what was current before is again.
  class Turn {
   public:
    explicit Turn(EglContext& context);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    /// Not ok when the driver refused: the device was lost.
    const core::Status& status() const { return status_; }

   private:
    EglContext& context_;
    std::unique_lock<std::mutex> lock_;
    EGLenum api_before_;
    EGLDisplay display_before_;
    EGLContext context_before_;
    EGLSurface draw_before_;
    EGLSurface read_before_;
    core::Status status_;
  };

 private:
  EglContext(EGLDisplay display, EGLContext context, EGLSurface surface)
      : display_(display), context_(context), surface_(surface) {}
  static std::unique_ptr<EglContext> on_display(EGLDisplay display, std::string* reasons);

  EGLDisplay display_;
  EGLContext context_;
  EGLSurface surface_;  ///< EGL_NO_SURFACE where the driver can do without.
  std::mutex mutex_;
};

}  // namespace prescene::rendering
