// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/scene_size.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/belief/validation.h"
#include "prescene/geometry/mesh_facts.h"

namespace prescene::belief {
namespace {

geometry::Box bounds_of(const ObjectModel& model) {
  if (model.collision.size() == 1)
    if (const auto* only = std::get_if<MeshShape>(&model.collision.front());
        only != nullptr && only->mesh && only->X_OS == geometry::Pose::identity())
      return geometry::facts_of(only->mesh).box;
  return geometry::bounding_box(collision_mesh(model));
}

}  // namespace

double object_size(const ObjectModel& model) { return std::cbrt(bounds_of(model).sizes().prod()); }

double smallest_size(const Scene& scene) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const SceneObject& object : scene.objects) {
    const double size = object_size(scene.model_of(object));
    if (size > 0.0) smallest = std::min(smallest, size);
  }
  return std::isfinite(smallest) ? smallest : kHouseholdSize;
}

double world_radius(const Scene& scene) { return kWorldRadius * std::max(1.0, smallest_size(scene) / kLargestInWorld); }

}  // namespace prescene::belief
