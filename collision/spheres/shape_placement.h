// SPDX-License-Identifier: Apache-2.0
// Where a packed body is seen from a static shape, in double precision.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/transform.h"

namespace prescene::collision {

struct ShapePlacement {
  Eigen::Matrix3d R_AB;
  Eigen::Vector3d p_AB;
  double slack = 0.0;  ///< What lengths may be off as the rotation was rounded, m.

  ShapePlacement(const SphereTree& a, const Transform& X_AB) {
    for (int row = 0; row < 3; ++row) {
      for (int col = 0; col < 3; ++col)
        R_AB(row, col) = static_cast<double>(X_AB.rotation[static_cast<std::size_t>(3 * row + col)]);
      p_AB[row] = static_cast<double>(X_AB.translation[static_cast<std::size_t>(row)]);
    }
    slack = 4.0 * static_cast<double>(std::numeric_limits<float>::epsilon()) *
            (static_cast<double>(a.root().centre.norm() + a.root().radius) + p_AB.norm());
  }
  Eigen::Vector3d to_shape(const Eigen::Vector3d& p_A) const { return R_AB.transpose() * (p_A - p_AB); }
  Eigen::Vector3d to_shape(const Vector3f& p_A) const { return to_shape(Eigen::Vector3d(p_A.cast<double>())); }
};

}  // namespace prescene::collision
