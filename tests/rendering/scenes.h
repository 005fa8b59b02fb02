// SPDX-License-Identifier: Apache-2.0
// Meshes and views that the rendering tests share.
#pragma once

#include <string>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/primitives.h"
#include "prescene/rendering/render_scene.h"

namespace prescene::tests {

struct NamedMesh {
  std::string name;
  geometry::TriangleMesh mesh;
};

/// Twenty meshes: primitives round and flat, closed containers, open sheets, a triangle soup.
std::vector<NamedMesh> twenty_meshes();

/// A camera like those of common RGB-D sensors, of any width, 4:3.
geometry::PinholeCamera camera_of_width(int width);

/// A pose of the object's frame in C, uniformly turned, its origin in the view at a depth from `near` to `far`.
geometry::Pose random_view_pose(const geometry::PinholeCamera& camera, double near, double far,
                                core::RandomStream& stream);

}  // namespace prescene::tests
