// SPDX-License-Identifier: Apache-2.0
// How a body moves while a continuous query watches: steadily along a screw, or turning steadily about a point of it
// that flies straight on.
//
//   PRESCENE_TRY(const ScrewMotion screw, ScrewMotion::make(X_AB_start, X_AB_end));
//   PRESCENE_TRY(const RigidMotion thrown, RigidMotion::thrown(X_AB, V_AB, centre_of_mass_B));
#pragma once

#include <Eigen/Core>
#include <optional>

#include "prescene/collision/screw_motion.h"
#include "prescene/core/status.h"
#include "prescene/geometry/pose.h"

namespace prescene::collision {

/// Velocities of all points of B at one time, in A, m for t from 0 to 1: a steady one that is the same for all points
/// and times, and the swirl of a point, which turns with it and keeps its length.
struct MotionField {
  Eigen::Vector3d spin;  ///< Rotation vector for t from 0 to 1, radians.
  Eigen::Vector3d steady;
  Eigen::Vector3d swirl_at_origin;  ///< Of the point of B that is at A's origin now.

  Eigen::Vector3d swirl(const Eigen::Vector3d& p) const { return spin.cross(p) + swirl_at_origin; }
  Eigen::Vector3d velocity(const Eigen::Vector3d& p) const { return steady + swirl(p); }
};

/// X_AB(t) for t in [0, 1].
class RigidMotion {
 public:
  RigidMotion(const ScrewMotion& screw);  // NOLINT(google-explicit-constructor): a screw is a rigid motion.

  /// From X_AB_start, the point P of B, p_BP, moves by V_AB.linear on a straight line while B turns about it by
  /// V_AB.angular (both in A, for t from 0 to 1; any number of turns up to a thousand). Fails with kInvalidInput as
  /// to_transform does, and when the velocities are not finite or carry P, or turn B, further than that.
  static core::Result<RigidMotion> thrown(const geometry::Pose& X_AB_start, const geometry::Twist& V_AB,
                                          const Eigen::Vector3d& p_BP = Eigen::Vector3d::Zero());

  geometry::Pose pose(double t) const;
  MotionField field(double t) const;

 private:
  RigidMotion() = default;

  std::optional<ScrewMotion> screw_;
  // Where B is thrown:
  geometry::Pose start_;
  Eigen::Vector3d spin_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d linear_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_AP_ = Eigen::Vector3d::Zero();  // At the start.
};

}  // namespace prescene::collision
