// SPDX-License-Identifier: Apache-2.0
// A box that falls onto the plane z = 0 and comes to rest, by ODE and by MuJoCo: independent references for falls.
#pragma once

#include "prescene/geometry/pose.h"

namespace prescene::tests {

struct FallingBox {
  geometry::Vector3d size;  ///< Full edges, m; uniform density.
  double mass = 1.0;
  double friction = 0.5;  ///< Of the pair; contacts do not bounce.
  geometry::Pose X_WB;
  geometry::Twist V_WB;   ///< Of the centre, in W.
  double duration = 2.0;  ///< s
  double step = 1e-3;     ///< s
};

/// X_WB after `duration`.
geometry::Pose fall_by_ode(const FallingBox& box);
/// Its contacts are springs with critical damping: the box sinks in by some tenths of a millimetre.
geometry::Pose fall_by_mujoco(const FallingBox& box);

}  // namespace prescene::tests
