// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/planning/mover.h"

#include <algorithm>
#include <cmath>

namespace prescene::interfaces {
namespace {

using geometry::Pose;
using geometry::Quaterniond;
using geometry::Vector3d;

Quaterniond turn_of(std::span<const double> q) { return Quaterniond(q[6], q[3], q[4], q[5]); }

/// Rotation vector in the world of the shorter turn. Which of two turns by pi it is depends on the sign of the dot
/// product, summed as OMPL does.
Vector3d shorter_turn(std::span<const double> q0, std::span<const double> q1) {
  const double dot = q0[3] * q1[3] + q0[4] * q1[4] + q0[5] * q1[5] + q0[6] * q1[6];
  const Quaterniond from = turn_of(q0).normalized();
  Quaterniond to = turn_of(q1).normalized();
  if (dot < 0.0) to.coeffs() = -to.coeffs();
  const Quaterniond turn = to * from.conjugate();
  const double sine = turn.vec().norm();
  // Below this the half angle and its sine are the same number.
  if (sine < 1e-9) return 2.0 * turn.vec();
  return (2.0 * std::atan2(sine, turn.w()) / sine) * turn.vec();
}

}  // namespace

bool Mover::is_configuration(std::span<const double> q) const {
  return std::all_of(q.begin(), q.end(), [](double value) { return std::isfinite(value); });
}

bool RigidBody::is_configuration(std::span<const double> q) const {
  // Neither zero nor infinite, also where squares of tiny or huge numbers are: what is normalised has the length 1.
  return Mover::is_configuration(q) && std::isnormal(turn_of(q).squaredNorm());
}

RigidBody::RigidBody(std::string name, PlanningShape shape) { shapes_.push_back({std::move(name), std::move(shape)}); }

Pose RigidBody::pose(std::span<const double> q) { return {turn_of(q).normalized(), Vector3d(q[0], q[1], q[2])}; }

std::array<double, 7> RigidBody::configuration(const Pose& X_WB) {
  const auto& p = X_WB.translation;
  const auto& r = X_WB.rotation;
  return {p.x(), p.y(), p.z(), r.x(), r.y(), r.z(), r.w()};
}

void RigidBody::place(std::span<const double> q, std::span<Pose> X_WS, std::vector<Pose>* /*work*/) const {
  X_WS[0] = pose(q);
}

void RigidBody::between(std::span<const double> q0, std::span<const double> q1, double t, std::span<double> q) const {
  const Quaterniond turn = geometry::exp_rotation(t * shorter_turn(q0, q1)) * turn_of(q0).normalized();
  for (std::size_t i = 0; i < 3; ++i) q[i] = q0[i] + t * (q1[i] - q0[i]);
  q[3] = turn.x();
  q[4] = turn.y();
  q[5] = turn.z();
  q[6] = turn.w();
}

double RigidBody::way(std::size_t /*shape*/, std::optional<std::size_t> /*other*/, std::span<const double> q0,
                      std::span<const double> q1) const {
  return std::hypot(q1[0] - q0[0], q1[1] - q0[1], q1[2] - q0[2]) +
         shorter_turn(q0, q1).norm() * shapes_.front().shape.reach();
}

std::optional<geometry::Twist> RigidBody::steady_twist(std::span<const double> q0, std::span<const double> q1) const {
  return geometry::Twist{shorter_turn(q0, q1), Vector3d(q1[0] - q0[0], q1[1] - q0[1], q1[2] - q0[2])};
}

}  // namespace prescene::interfaces
