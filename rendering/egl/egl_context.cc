// SPDX-License-Identifier: Apache-2.0
#include "egl_context.h"

#include <EGL/eglext.h>

#include <array>
#include <string_view>
#include <vector>

namespace prescene::rendering {
namespace {

std::string error_text(EGLint error) {
  switch (error) {
    case EGL_SUCCESS:
      return "no error given";
    case EGL_NOT_INITIALIZED:
      return "the driver could not be started";
    case EGL_BAD_ACCESS:
      return "access denied";
    case EGL_BAD_ALLOC:
      return "out of memory";
    case EGL_BAD_MATCH:
      return "no such OpenGL version";
    case EGL_BAD_CONFIG:
      return "no configuration fits";
    case EGL_CONTEXT_LOST:
      return "the device was lost";
    default:
      return "EGL error " + std::to_string(error);
  }
}

bool has_extension(const char* list, std::string_view name) {
  if (list == nullptr) return false;
  const std::string padded = ' ' + std::string(list) + ' ';
  return padded.find(' ' + std::string(name) + ' ') != std::string::npos;
}

template <class Function>
Function function_named(const char* name) {
  return reinterpret_cast<Function>(eglGetProcAddress(name));
}

/// Displays to try, best first.
std::vector<EGLDisplay> candidate_displays(std::string* reasons) {
  std::vector<EGLDisplay> displays;
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto platform_display = function_named<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (platform_display == nullptr) {
    *reasons += " libEGL is too old (no EGL_EXT_platform_base);";
    return displays;
  }
  const auto query_devices = function_named<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
  if (query_devices != nullptr && has_extension(client, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count);
    for (EGLint i = 0; i < count; ++i)
      displays.push_back(platform_display(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr));
  }
  if (has_extension(client, "EGL_MESA_platform_surfaceless"))
    displays.push_back(platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  if (displays.empty()) *reasons += " no driver offers EGL_EXT_platform_device or EGL_MESA_platform_surfaceless;";
  return displays;
}

}  // namespace

std::unique_ptr<EglContext> EglContext::on_display(EGLDisplay display, std::string* reasons) {
  const auto failed = [&](const char* what) {
    *reasons += ' ' + std::string(what) + ": " + error_text(eglGetError()) + ';';
    return nullptr;
  };
  if (display == EGL_NO_DISPLAY || eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return failed("eglInitialize");
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return failed("eglBindAPI(OpenGL)");
  const bool surfaceless = has_extension(eglQueryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context");
  const EGLint config_wish[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE,
                                surfaceless ? 0 : EGL_PBUFFER_BIT, EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  if (eglChooseConfig(display, config_wish, &config, 1, &configs) != EGL_TRUE || configs < 1)
    return failed("eglChooseConfig");
  const EGLint context_wish[] = {
      EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, context_wish);
  if (context == EGL_NO_CONTEXT) return failed("eglCreateContext(OpenGL 3.3)");
  EGLSurface surface = EGL_NO_SURFACE;
  if (!surfaceless) {
    const EGLint one_pixel[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
    surface = eglCreatePbufferSurface(display, config, one_pixel);
    if (surface == EGL_NO_SURFACE) {
      eglDestroyContext(display, context);
      return failed("eglCreatePbufferSurface");
    }
  }
  std::unique_ptr<EglContext> made(new EglContext(display, context, surface));
  if (!Turn(*made).status().ok()) return failed("eglMakeCurrent");
  return made;
}

core::Result<std::unique_ptr<EglContext>> EglContext::make() {
  const EGLenum api_before = eglQueryAPI();
  std::string reasons;
  std::unique_ptr<EglContext> context;
  for (const EGLDisplay display : candidate_displays(&reasons)) {
    context = on_display(display, &reasons);
    if (context != nullptr) break;
  }
  eglBindAPI(api_before);
  if (context != nullptr) return context;
  return core::unavailable("OpenGL renderer: no OpenGL 3.3 without a display:" + reasons +
                           " install the Debian packages libegl-mesa0 and libgl1-mesa-dri (software rendering) or the "
                           "driver of your graphics card, or use the reference renderer");
}

EglContext::~EglContext() {
  eglDestroyContext(display_, context_);
  if (surface_ != EGL_NO_SURFACE) eglDestroySurface(display_, surface_);
}

EglContext::Turn::Turn(EglContext& context)
    : context_(context),
      lock_(context.mutex_),
      api_before_(eglQueryAPI()),
      display_before_(EGL_NO_DISPLAY),
      context_before_(EGL_NO_CONTEXT),
      draw_before_(EGL_NO_SURFACE),
      read_before_(EGL_NO_SURFACE) {
  eglBindAPI(EGL_OPENGL_API);
  display_before_ = eglGetCurrentDisplay();
  context_before_ = eglGetCurrentContext();
  draw_before_ = eglGetCurrentSurface(EGL_DRAW);
  read_before_ = eglGetCurrentSurface(EGL_READ);
  if (eglMakeCurrent(context.display_, context.surface_, context.surface_, context.context_) != EGL_TRUE)
    status_ = core::unavailable("OpenGL renderer: the context can't be used: " + error_text(eglGetError()) +
                                ": make a new renderer");
}

EglContext::Turn::~Turn() {
  if (context_before_ != EGL_NO_CONTEXT)
    eglMakeCurrent(display_before_, draw_before_, read_before_, context_before_);
  else
    eglMakeCurrent(context_.display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglBindAPI(api_before_);
}

}  // namespace prescene::rendering
