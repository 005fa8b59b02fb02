// SPDX-License-Identifier: Apache-2.0
// A body that turns and moves steadily from one pose to another: what continuous queries take for a motion.
//
//   PRESCENE_TRY(const ScrewMotion motion, ScrewMotion::make(X_AB_start, X_AB_end));
#pragma once

#include <Eigen/Core>

#include "prescene/collision/transform.h"
#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision {

/// X_AB(t) = exp(t twist) X_AB(0) for t in [0, 1]: turns about one axis in A by at most half a turn, and moves along
/// it. Its inverse, the motion of A in B, is one as well.
class ScrewMotion {
 public:
  /// Fails with kInvalidInput as to_transform does. Of two turns by pi, one is taken.
  static core::Result<ScrewMotion> make(const geometry::Pose& X_AB_start, const geometry::Pose& X_AB_end);

  /// t is not limited to [0, 1].
  geometry::Pose pose(double t) const;
  /// Place at t of the point of B that is at p_start at t = 0, in A, m.
  Eigen::Vector3d place(const Eigen::Vector3d& p_start, double t) const;
  /// Length of the second derivative of place(p_start, t) by t, m; constant in t. Between times t0 and t1 the point
  /// deviates from its chord, traversed at constant speed, by at most bend (t1 - t0)^2 / 8.
  double bend(const Eigen::Vector3d& p_start) const { return spin_.cross(velocity(p_start)).norm(); }
  /// Length of the first derivative, m; constant in t.
  double speed(const Eigen::Vector3d& p_start) const { return velocity(p_start).norm(); }

  const geometry::Pose& start() const { return start_; }
  /// Rotation vector from start to end in A, radians.
  const Eigen::Vector3d& spin() const { return spin_; }
  /// Velocity at t = 0 of the point of B at A's origin, m.
  const Eigen::Vector3d& drift() const { return drift_; }

 private:
  ScrewMotion() = default;
  Eigen::Vector3d velocity(const Eigen::Vector3d& p_start) const { return spin_.cross(p_start) + drift_; }

  geometry::Pose start_;
  Eigen::Vector3d spin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d drift_ = Eigen::Vector3d::Zero();
};

/// Motions are cut so that spheres leave their chords by at most this share of the smaller body's radius: less cuts
/// more often and prunes better.
inline constexpr double kChordDeviation = 0.02;
/// Into how many equal pieces, at most 256, a path over [0, 1] whose second derivative is at most `bend` is cut so that
/// it leaves its chords by at most `deviation`, of the same unit.
int chord_pieces(double bend, double deviation);

}  // namespace prescene::collision
