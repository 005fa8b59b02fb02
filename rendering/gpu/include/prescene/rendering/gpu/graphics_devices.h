// SPDX-License-Identifier: Apache-2.0
// Which graphics devices OpenGL without a display finds here, and which of them to take.
//
//   for (const GraphicsDevice& device : graphics_devices()) std::cout << device.index << " " << device.name << "\n";
//   DeviceChoice choice;
//   choice.device = 1;
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

namespace prescene::rendering {

/// One device of EGL, in the order in which EGL lists them.
struct GraphicsDevice {
  int index = 0;
  std::string name;       ///< What the driver reports without a context: a name, a device file, or "".
  bool software = false;  ///< Draws on the processor (Mesa's llvmpipe and its like).
};

/// Empty where no driver lists devices, or when the build left OpenGL out.
std::vector<GraphicsDevice> graphics_devices();

/// Accidents to try, for tests. Each is counted down when it happens.
struct GraphicsFaults {
  std::atomic<int> losses{0};    ///< Contexts that are gone when they are next used.
  std::atomic<int> resets{0};    ///< Resets of the device that the driver reports after work.
  std::atomic<int> refusals{0};  ///< Contexts that can't be made.
};

/// Which device a context is made on.
struct DeviceChoice {
  int device = -1;             ///< Index, see graphics_devices(); -1 = the first that will do, graphics cards first.
  bool hardware_only = false;  ///< No device that draws on the processor.
  std::shared_ptr<GraphicsFaults> faults;  ///< Null but in tests.
};

}  // namespace prescene::rendering
