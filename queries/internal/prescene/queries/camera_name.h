// SPDX-License-Identifier: Apache-2.0
// What answers and pictures call the camera that a frame is of.
#pragma once

#include <string>

#include "prescene/belief/scene.h"

namespace prescene::queries {

/// The name of that camera of the scene; "" where it is the only one.
inline std::string camera_name(const belief::Scene& scene, int camera) {
  const belief::SceneCamera* of = scene.more_cameras.empty() ? nullptr : belief::camera_at(scene, camera);
  return of == nullptr ? "" : of->name;
}

}  // namespace prescene::queries
