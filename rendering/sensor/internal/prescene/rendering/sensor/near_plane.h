// SPDX-License-Identifier: Apache-2.0
// What the sensor's nearest depth leaves of an object.
#pragma once

#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering {

/// Depth from which objects are drawn, m: a hair beyond the range's start, where the occluder's interval has no length.
inline float nearest_drawn(const SensorModelOptions& options) { return static_cast<float>(options.min_depth) + 1e-4f; }

enum class NearPlane {
  kLeavesNothing,  ///< Nothing to see, or nothing to draw.
  kMayCut,         ///< Faces may have to be cut.
  kLeavesAll,
};

/// By the mesh's bounding sphere.
inline NearPlane near_plane(const PoseHypothesis& hypothesis, const SensorModelOptions& options) {
  const RenderMesh& mesh = *hypothesis.mesh;
  const auto depth = static_cast<float>((hypothesis.X_CO * mesh.centre.cast<double>().eval()).z());
  const float nearest = nearest_drawn(options);
  if (mesh.triangles.empty() || depth + mesh.radius <= nearest) return NearPlane::kLeavesNothing;
  return depth - mesh.radius < nearest ? NearPlane::kMayCut : NearPlane::kLeavesAll;
}

}  // namespace prescene::rendering
