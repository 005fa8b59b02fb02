// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/rigid_motion.h"

#include <cmath>
#include <string>

#include "prescene/collision/mesh.h"
#include "prescene/core/text.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

constexpr double kMostTurns = 1000.0;

}  // namespace

RigidMotion::RigidMotion(const ScrewMotion& screw) : screw_(screw) {}

core::Result<RigidMotion> RigidMotion::thrown(const geometry::Pose& X_AB_start, const geometry::Twist& V_AB,
                                              const Vector3d& p_BP) {
  const auto start = to_transform(X_AB_start);
  if (!start.ok()) return start.status().at("start of the motion");
  if (!V_AB.is_finite() || !p_BP.allFinite())
    return core::invalid_input("the velocities of the motion, or the point that moves, are not finite; check them");
  if (V_AB.angular.norm() > kMostTurns * 2.0 * M_PI) {
    return core::invalid_input("the motion turns by " + core::rounded_text(V_AB.angular.norm()) +
                               " rad; cut it into shorter ones of at most a thousand turns");
  }
  RigidMotion motion;
  motion.start_ = normalized(X_AB_start);
  motion.spin_ = V_AB.angular;
  motion.linear_ = V_AB.linear;
  motion.p_AP_ = motion.start_ * p_BP;
  const auto far = static_cast<double>(kLargestCoordinate);
  if (p_BP.norm() + motion.p_AP_.norm() + motion.linear_.norm() > far) {
    return core::invalid_input("the motion goes " + core::rounded_text(motion.linear_.norm()) +
                               " m; the limit is 1e9 m: check the unit of the velocity");
  }
  return motion;
}

geometry::Pose RigidMotion::pose(double t) const {
  if (screw_) return screw_->pose(t);
  const geometry::Quaterniond turn = geometry::exp_rotation(t * spin_);
  return {(turn * start_.rotation).normalized(), p_AP_ + t * linear_ + turn * (start_.translation - p_AP_)};
}

MotionField RigidMotion::field(double t) const {
  if (!screw_) return {spin_, linear_, -spin_.cross(p_AP_ + t * linear_)};
  const Vector3d& spin = screw_->spin();
  const Vector3d& drift = screw_->drift();
  const double square = spin.squaredNorm();
  const Vector3d steady = square > 0.0 ? Vector3d(spin * (spin.dot(drift) / square)) : drift;
  return {spin, steady, drift - steady};
}

}  // namespace prescene::collision
