// SPDX-License-Identifier: Apache-2.0
// Places spread over a mesh's faces by throwing darts, closer where they bend [Cook 1986].
#pragma once

#include <Eigen/Core>
#include <vector>

#include "prescene/collision/mesh.h"
#include "surface_features.h"

namespace prescene::collision {

struct SurfaceSample {
  Eigen::Vector3d point, normal;
  double spacing = 0.0;  ///< From samples of the same side, at least, m.
  double reach = 0.0;    ///< To the farthest dart that it kept away, m.
  double rise = 0.0;     ///< By which its sphere may leave the facets, m.
};

struct SurfaceSamples {
  std::vector<SurfaceSample> samples;
  double spacing = 0.0;  ///< On flat faces, m.
};

/// About `count` of them.
SurfaceSamples sample_faces(const Mesh& mesh, const SurfaceFeatures& features, int count);

}  // namespace prescene::collision
