// SPDX-License-Identifier: Apache-2.0
// How a body's inertia turns with it, and how a rotation goes on.
#pragma once

#include "compiled_scene.h"

namespace prescene::simulation {

inline Matrix3d world_inertia(const Quaterniond& R_WO, const CompiledBody& body, double mass) {
  const Matrix3d R_WP = R_WO.toRotationMatrix() * body.R_OP;
  return R_WP * (mass * body.unit_moments).asDiagonal() * R_WP.transpose();
}

inline Matrix3d world_inverse_inertia(const Quaterniond& R_WO, const CompiledBody& body, double mass) {
  const Matrix3d R_WP = R_WO.toRotationMatrix() * body.R_OP;
  return R_WP * (mass * body.unit_moments).cwiseInverse().asDiagonal() * R_WP.transpose();
}

inline Quaterniond turned(const Quaterniond& R, const Vector3d& rotation_vector) {
  return (geometry::exp_rotation(rotation_vector) * R).normalized();
}

}  // namespace prescene::simulation
