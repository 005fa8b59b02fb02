// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/screw_motion.h"

#include <cmath>

namespace prescene::collision {

namespace {

using Eigen::Vector3d;

// Below this the series' next terms are less than rounding.
constexpr double kSmallAngle = 1e-2;

double squared(double x) { return x * x; }

/// (1 - cos x) / x^2
double versine_ratio(double x) {
  if (std::abs(x) > kSmallAngle) return 2.0 * squared(std::sin(0.5 * x) / x);
  const double y = x * x;
  return 0.5 - y / 24.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0));
}
/// (x - sin x) / x^3
double sine_rest_ratio(double x) {
  if (std::abs(x) > kSmallAngle) return (x - std::sin(x)) / (x * x * x);
  const double y = x * x;
  return (1.0 - y / 20.0 * (1.0 - y / 42.0 * (1.0 - y / 72.0))) / 6.0;
}

/// Integral of exp(s t) v over t in [0, 1].
Vector3d mean_turned(const Vector3d& s, const Vector3d& v) {
  const double angle = s.norm();
  const Vector3d once = s.cross(v);
  return v + versine_ratio(angle) * once + sine_rest_ratio(angle) * s.cross(once);
}

/// The v with mean_turned(s, v) == mean; |s| <= pi.
Vector3d drift_for(const Vector3d& s, const Vector3d& mean) {
  const double angle = s.norm();
  const Vector3d once = s.cross(mean);
  // 1 - (x / 2) cot(x / 2) over x^2
  double ratio = 1.0 / 12.0 + angle * angle / 720.0;
  if (angle > kSmallAngle) ratio = (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return mean - 0.5 * once + ratio * s.cross(once);
}

}  // namespace

core::Result<ScrewMotion> ScrewMotion::make(const geometry::Pose& X_AB_start, const geometry::Pose& X_AB_end) {
  const auto start = to_transform(X_AB_start);
  if (!start.ok()) return start.status().at("start of the motion");
  const auto end = to_transform(X_AB_end);
  if (!end.ok()) return end.status().at("end of the motion");
  ScrewMotion motion;
  motion.start_ = normalized(X_AB_start);
  const geometry::Pose step = normalized(X_AB_end) * motion.start_.inverse();
  motion.spin_ = geometry::log_rotation(step.rotation.normalized());
  motion.drift_ = drift_for(motion.spin_, step.translation);
  return motion;
}

geometry::Pose ScrewMotion::pose(double t) const {
  const geometry::Quaterniond turn = geometry::exp_rotation(t * spin_);
  return {(turn * start_.rotation).normalized(), place(start_.translation, t)};
}

Vector3d ScrewMotion::place(const Vector3d& p_start, double t) const {
  // p + the integral of exp(spin s) velocity over s: no large terms cancel, however far the axis is.
  return p_start + t * mean_turned(t * spin_, velocity(p_start));
}

int chord_pieces(double bend, double deviation) {
  constexpr double kMostPieces = 256.0;
  return static_cast<int>(std::clamp(std::ceil(std::sqrt(0.125 * bend / deviation)), 1.0, kMostPieces));
}

}  // namespace prescene::collision
