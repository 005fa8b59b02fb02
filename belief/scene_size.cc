// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/scene_size.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/belief/validation.h"

namespace prescene::belief {

double smallest_size(const Scene& scene) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const SceneObject& object : scene.objects) {
    const double size = std::cbrt(geometry::bounding_box(collision_mesh(scene.model_of(object))).sizes().prod());
    if (size > 0.0) smallest = std::min(smallest, size);
  }
  return std::isfinite(smallest) ? smallest : kHouseholdSize;
}

double world_radius(const Scene& scene) { return kWorldRadius * std::max(1.0, smallest_size(scene) / kLargestInWorld); }

}  // namespace prescene::belief
