// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of geometry take for granted.
#pragma once

#include <Eigen/Core>

#include "prescene/geometry/triangle_mesh.h"

namespace prescene::geometry::given_geometry {

extern const TriangleMesh mesh, coarse;

namespace dense_solvers_h {
extern const Eigen::MatrixXd covariance;
}  // namespace dense_solvers_h

}  // namespace prescene::geometry::given_geometry
