// SPDX-License-Identifier: Apache-2.0
// An OpenGL context without window or display, and turns at using it.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "prescene/core/status.h"
#include "prescene/rendering/gpu/graphics_devices.h"

namespace prescene::rendering {

/// What is asked of OpenGL, core profile.
struct GlVersion {
  int major = 3;
  int minor = 3;
};

/// Owns one context. The EGL display that it came from stays initialised until the program ends: it belongs to the
/// whole process, and closing it would take it from everybody else.
class EglContext {
 public:
  /// On the device that is chosen, else the first EGL device that gives such a context, graphics cards first, else
  /// Mesa's surfaceless platform. `user` begins the message of a failure, which is kUnavailable, or kInvalidInput for
  /// an index that EGL does not list.
  static core::Result<std::unique_ptr<EglContext>> make(const GlVersion& version, const DeviceChoice& choice,
                                                        const std::string& user);
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// The driver's own name, and whether it draws on the processor.
  const std::string& device() const { return device_; }
  bool software() const { return software_; }

  /// While it lives, the context is current on this thread and on no other; then what was current before is again.
  class Turn {
   public:
    explicit Turn(EglContext& context);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    /// kUnavailable when the driver refused: the context is lost.
    const core::Status& status() const { return status_; }
    /// kUnavailable when the device was reset since the context was made: what it holds is lost.
    core::Status reset_status() const;

   private:
    EglContext& context_;
    std::unique_lock<std::mutex> lock_;
    unsigned api_before_;
    void* display_before_ = nullptr;
    void* context_before_ = nullptr;
    void* draw_before_ = nullptr;
    void* read_before_ = nullptr;
    core::Status status_;
  };

 private:
  EglContext() = default;
  static std::unique_ptr<EglContext> on_display(void* display, const GlVersion& version, const DeviceChoice& choice,
                                                std::string* reasons);

  // EGLDisplay, EGLContext and EGLSurface.
  void* display_ = nullptr;
  void* context_ = nullptr;
  void* surface_ = nullptr;  ///< None where the driver can do without.
  std::string device_;
  bool software_ = false;
  std::shared_ptr<GraphicsFaults> faults_;
  std::mutex mutex_;
};

}  // namespace prescene::rendering
