// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of geometry take for granted.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/polygon.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry::given_geometry {

extern const TriangleMesh mesh;

namespace dense_solvers_h {
extern const Eigen::MatrixXd covariance;
}  // namespace dense_solvers_h

namespace level_camera_h {
extern const Vector3d target, eye;
}  // namespace level_camera_h

namespace mesh_facts_h {
extern const std::shared_ptr<const TriangleMesh> cup;
}  // namespace mesh_facts_h

namespace pixel_rays_h {
extern const PinholeCamera camera;
extern const DepthImage depth;
extern const int x, y;
}  // namespace pixel_rays_h

namespace polygon_h {
extern const std::vector<Vector2d> points;
extern const Vector2d p;
}  // namespace polygon_h

namespace surface_tree_h {
extern const Vector3d p;
}  // namespace surface_tree_h

}  // namespace prescene::geometry::given_geometry
