// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/renderer.h"

#include <cmath>
#include <string>

#include "prescene/core/check.h"

namespace prescene::rendering {

core::Status validate(const RenderJob& job, const RenderOptions& options) {
  PRESCENE_CHECK(job.scene != nullptr);
  PRESCENE_RETURN_IF_ERROR(geometry::validate(job.camera));
  if (!(options.near_depth > 0.0 && std::isfinite(options.far_depth) && options.far_depth > options.near_depth))
    return core::invalid_input("rendering: the clip range is " + std::to_string(options.near_depth) + " to " +
                               std::to_string(options.far_depth) + " m: give 0 < near_depth < far_depth");
  const Lighting& light = options.lighting;
  if (options.color && !(light.towards_light_W.allFinite() && light.towards_light_W.norm() > 0.0 &&
                         light.ambient >= 0.0 && light.direct >= 0.0 && std::isfinite(light.ambient + light.direct)))
    return core::invalid_input(
        "rendering: the light has no direction or a share below 0: give a direction, and shares of 0 and more");
  constexpr std::size_t kMaxInstances = 65535;
  if (job.scene->instances.size() > kMaxInstances)
    return core::invalid_input("rendering: the scene has " + std::to_string(job.scene->instances.size()) +
                               " instances: labels have room for 65535, join meshes that need no label of their own");
  if (!job.X_WC.is_finite()) return core::invalid_input("rendering: the camera's pose is not finite");
  for (std::size_t i = 0; i < job.scene->instances.size(); ++i)
    if (!job.scene->instances[i].X_WM.is_finite())
      return core::invalid_input("rendering: the pose of instance " + std::to_string(i) + " is not finite");
  return core::ok_status();
}

}  // namespace prescene::rendering
