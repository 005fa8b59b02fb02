// SPDX-License-Identifier: Apache-2.0
// How a body's inertia turns with it, and how a rotation goes on.
#pragma once

#include "compiled_scene.h"
#include "prescene/simulation/rules/free_spin.h"

namespace prescene::simulation {

inline Matrix3d world_inertia(const Quaterniond& R_WO, const CompiledBody& body, double mass) {
  const Matrix3d R_WP = R_WO.toRotationMatrix() * body.R_OP;
  return R_WP * (mass * body.unit_moments).asDiagonal() * R_WP.transpose();
}

struct Spin {
  Quaterniond R_WO;
  Vector3d w_WO;
};
/// After a step without torque.
inline Spin spun(const Quaterniond& R_WO, const Vector3d& w_WO, const CompiledBody& body, double dt) {
  const SpinRates rates = spin_rates(body.unit_moments, dt);
  Quaterniond R = R_WO;
  Vector3d L_P = body.unit_moments.cwiseProduct(body.R_OP.transpose() * (R.conjugate() * w_WO));
  for (const Vector3d* about : {&rates.about_least, &rates.about_most, &rates.about_least}) {
    const Vector3d turn_P = about->cwiseProduct(L_P);
    R = R * geometry::exp_rotation(body.R_OP * turn_P);
    L_P = geometry::exp_rotation(-turn_P) * L_P;
  }
  const Vector3d L_W = R * (body.R_OP * L_P);
  R = (geometry::exp_rotation(rates.about_momentum * L_W) * R).normalized();
  return {R, R * (body.R_OP * L_P.cwiseQuotient(body.unit_moments))};
}

/// Turned by a rotation vector in W, without a change of its energy: the spin turns along, but for where the body looks
/// the same about an axis, which keeps more of its angular momentum.
inline Spin turned(const Spin& spin, const Vector3d& rotation_vector, const CompiledBody& body) {
  const Vector3d turn_P = body.R_OP.transpose() * (spin.R_WO.conjugate() * rotation_vector);
  const Vector3d with_spin_P = uneven_axes(body.unit_moments).cwiseProduct(turn_P);
  const Quaterniond along = geometry::exp_rotation(spin.R_WO * (body.R_OP * with_spin_P));
  const Quaterniond alone = geometry::exp_rotation(body.R_OP * (turn_P - with_spin_P));
  return {(along * spin.R_WO * alone).normalized(), along * spin.w_WO};
}

}  // namespace prescene::simulation
