// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/gpu/egl_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <type_traits>
#include <vector>

namespace prescene::rendering {
namespace {

static_assert(std::is_same_v<EGLDisplay, void*> && std::is_same_v<EGLContext, void*> &&
              std::is_same_v<EGLSurface, void*>);

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

/// EGL's list of devices, and the functions that describe them; empty where there is no such list.
struct DeviceList {
  DeviceList() {
    const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    const bool listed = has_extension(client, "EGL_EXT_platform_device") ||
                        has_extension(client, "EGL_EXT_device_base") ||
                        has_extension(client, "EGL_EXT_device_enumeration");
    const auto query_devices = function_named<PFNEGLQUERYDEVICESEXTPROC>("eglQueryDevicesEXT");
    if (!listed || query_devices == nullptr) return;
    std::array<EGLDeviceEXT, 32> found{};
    EGLint count = 0;
    if (query_devices(static_cast<EGLint>(found.size()), found.data(), &count) != EGL_TRUE) return;
    devices.assign(found.begin(), found.begin() + count);
    query_text = function_named<PFNEGLQUERYDEVICESTRINGEXTPROC>("eglQueryDeviceStringEXT");
  }

  GraphicsDevice describe(std::size_t i) const {
    GraphicsDevice device;
    device.index = static_cast<int>(i);
    if (query_text == nullptr) return device;
    const char* extensions = query_text(devices[i], EGL_EXTENSIONS);
    device.software = has_extension(extensions, "EGL_MESA_device_software");
    const char* name = nullptr;
    if (has_extension(extensions, "EGL_EXT_device_query_name")) name = query_text(devices[i], EGL_RENDERER_EXT);
    if (name == nullptr && has_extension(extensions, "EGL_EXT_device_drm"))
      name = query_text(devices[i], EGL_DRM_DEVICE_FILE_EXT);
    if (name != nullptr) device.name = name;
    if (device.name.empty() && device.software) device.name = "software";
    return device;
  }

  std::vector<EGLDeviceEXT> devices;
  PFNEGLQUERYDEVICESTRINGEXTPROC query_text = nullptr;
};

/// Displays to try, best first.
core::Result<std::vector<EGLDisplay>> candidate_displays(const DeviceChoice& choice, const std::string& user,
                                                         std::string* reasons) {
  std::vector<EGLDisplay> displays;
  const auto platform_display = function_named<PFNEGLGETPLATFORMDISPLAYEXTPROC>("eglGetPlatformDisplayEXT");
  if (platform_display == nullptr) {
    *reasons += " libEGL is too old (no EGL_EXT_platform_base);";
    return displays;
  }
  const DeviceList list;
  const auto count = static_cast<int>(list.devices.size());
  if (choice.device >= count)
    return core::invalid_input(user + ": there is no graphics device " + std::to_string(choice.device) +
                               ": EGL lists " + std::to_string(count) +
                               (count > 0 ? ", from 0 on" : "; leave the choice open"));
  std::vector<EGLDisplay> of_software;
  for (int i = 0; i < count; ++i) {
    if (choice.device >= 0 && i != choice.device) continue;
    const auto number = static_cast<std::size_t>(i);
    const bool software = list.describe(number).software;
    if (choice.hardware_only && software) continue;
    (software ? of_software : displays)
        .push_back(platform_display(EGL_PLATFORM_DEVICE_EXT, list.devices[number], nullptr));
  }
  displays.insert(displays.end(), of_software.begin(), of_software.end());
  const bool surfaceless =
      has_extension(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless");
  if (surfaceless && choice.device < 0)
    displays.push_back(platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  if (displays.empty()) *reasons += " no driver offers EGL_EXT_platform_device or EGL_MESA_platform_surfaceless;";
  return displays;
}

/// Binds the API that was bound before, and lets EGL forget a thread that has no context of its own: what it keeps for
/// threads that live as long as the program, as those of pools do, libEGL would free twice at the program's end.
void leave_thread(EGLenum api_before) {
  const bool forget = eglGetCurrentContext() == EGL_NO_CONTEXT;
  if (forget) eglReleaseThread();
  if (!forget || api_before != EGL_OPENGL_ES_API) eglBindAPI(api_before);
}

/// The same at the end of a function.
class ThreadVisit {
 public:
  ThreadVisit() : api_before_(eglQueryAPI()) {}
  ~ThreadVisit() { leave_thread(api_before_); }
  ThreadVisit(const ThreadVisit&) = delete;
  ThreadVisit& operator=(const ThreadVisit&) = delete;

 private:
  EGLenum api_before_;
};

/// By the driver's name for what it draws with.
bool draws_on_processor(std::string_view renderer) {
  for (const std::string_view name : {"llvmpipe", "softpipe", "swrast", "SWR", "Software Rasterizer", "SwiftShader"})
    if (renderer.find(name) != std::string_view::npos) return true;
  return false;
}

/// Counts an accident down; whether there was one to happen.
bool happens(const std::shared_ptr<GraphicsFaults>& faults, std::atomic<int> GraphicsFaults::*kind) {
  if (faults == nullptr) return false;
  std::atomic<int>& left = (*faults).*kind;
  int now = left.load();
  while (now > 0)
    if (left.compare_exchange_weak(now, now - 1)) return true;
  return false;
}

}  // namespace

std::vector<GraphicsDevice> graphics_devices() {
  const ThreadVisit visit;
  const DeviceList list;
  std::vector<GraphicsDevice> devices;
  for (std::size_t i = 0; i < list.devices.size(); ++i) devices.push_back(list.describe(i));
  return devices;
}

std::unique_ptr<EglContext> EglContext::on_display(void* display, const GlVersion& version, const DeviceChoice& choice,
                                                   std::string* reasons) {
  const auto failed = [&](const std::string& what) {
    *reasons += ' ' + what + ": " + error_text(eglGetError()) + ';';
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
  // First a context that reports when the device was reset; not every driver has one.
  const EGLint context_wish[] = {EGL_CONTEXT_MAJOR_VERSION,
                                 version.major,
                                 EGL_CONTEXT_MINOR_VERSION,
                                 version.minor,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                 EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY,
                                 EGL_LOSE_CONTEXT_ON_RESET,
                                 EGL_NONE};
  EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, context_wish);
  if (context == EGL_NO_CONTEXT) {
    EGLint plain_wish[std::size(context_wish)];
    std::copy(std::begin(context_wish), std::end(context_wish), plain_wish);
    plain_wish[6] = EGL_NONE;
    context = eglCreateContext(display, config, EGL_NO_CONTEXT, plain_wish);
  }
  const std::string name = "OpenGL " + std::to_string(version.major) + '.' + std::to_string(version.minor);
  if (context == EGL_NO_CONTEXT) return failed("eglCreateContext(" + name + ")");
  std::unique_ptr<EglContext> made(new EglContext());
  made->display_ = display;
  made->context_ = context;
  if (!surfaceless) {
    const EGLint one_pixel[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
    made->surface_ = eglCreatePbufferSurface(display, config, one_pixel);
    if (made->surface_ == EGL_NO_SURFACE) return failed("eglCreatePbufferSurface");
  }
  {
    const Turn turn(*made);
    if (!turn.status().ok()) return failed("eglMakeCurrent");
    const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
    made->device_ = renderer != nullptr ? renderer : "unknown";
    made->software_ = draws_on_processor(made->device_);
  }
  if (choice.hardware_only && made->software_) {
    *reasons += ' ' + made->device_ + " draws on the processor;";
    return nullptr;
  }
  made->faults_ = choice.faults;
  return made;
}

core::Result<std::unique_ptr<EglContext>> EglContext::make(const GlVersion& version, const DeviceChoice& choice,
                                                           const std::string& user) {
  if (happens(choice.faults, &GraphicsFaults::refusals))
    return core::unavailable(user + ": no context: a test refused it");
  const ThreadVisit visit;
  std::string reasons;
  PRESCENE_TRY(const auto displays, candidate_displays(choice, user, &reasons));
  std::unique_ptr<EglContext> context;
  for (const EGLDisplay display : displays) {
    context = on_display(display, version, choice, &reasons);
    if (context != nullptr) break;
  }
  if (context != nullptr) return context;
  return core::unavailable(
      user + ": no OpenGL " + std::to_string(version.major) + '.' + std::to_string(version.minor) +
      (choice.hardware_only ? " on a graphics card" : "") + " without a display:" + reasons +
      " install the Debian packages libegl-mesa0 and libgl1-mesa-dri (software rendering) or the driver of your "
      "graphics card, or let the processor do it");
}

EglContext::~EglContext() {
  const ThreadVisit visit;
  // One that a test took away is gone already.
  if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
  if (surface_ != EGL_NO_SURFACE) eglDestroySurface(display_, surface_);
}

EglContext::Turn::Turn(EglContext& context) : context_(context), lock_(context.mutex_), api_before_(eglQueryAPI()) {
  if (context.context_ != EGL_NO_CONTEXT && happens(context.faults_, &GraphicsFaults::losses)) {
    eglDestroyContext(context.display_, context.context_);
    context.context_ = EGL_NO_CONTEXT;
  }
  eglBindAPI(EGL_OPENGL_API);
  display_before_ = eglGetCurrentDisplay();
  context_before_ = eglGetCurrentContext();
  draw_before_ = eglGetCurrentSurface(EGL_DRAW);
  read_before_ = eglGetCurrentSurface(EGL_READ);
  if (context.context_ == EGL_NO_CONTEXT) {
    status_ = core::unavailable("OpenGL: the context is lost");
  } else if (eglMakeCurrent(context.display_, context.surface_, context.surface_, context.context_) != EGL_TRUE) {
    status_ = core::unavailable("OpenGL: the context can't be used: " + error_text(eglGetError()));
  }
}

core::Status EglContext::Turn::reset_status() const {
  PRESCENE_RETURN_IF_ERROR(status_);
  // Where the driver has no such call, it reports no reset.
  const bool reset = glGetGraphicsResetStatus() != GL_NO_ERROR;
  if (!reset && !happens(context_.faults_, &GraphicsFaults::resets)) return core::ok_status();
  return core::unavailable("OpenGL: the device was reset and lost what it held");
}

EglContext::Turn::~Turn() {
  if (context_before_ != EGL_NO_CONTEXT)
    eglMakeCurrent(display_before_, draw_before_, read_before_, context_before_);
  else
    eglMakeCurrent(context_.display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  leave_thread(api_before_);
}

}  // namespace prescene::rendering
