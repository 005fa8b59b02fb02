// SPDX-License-Identifier: Apache-2.0
// ContactSolver: the rows of joints. The five directions that a joint holds are solved as one block; along the axis
// friction, damping and limits are one piecewise linear law, solved with the response that the axis has while the other
// five are held. So one joint alone is exact after one iteration.
#include <algorithm>
#include <cmath>

#include "contact_solver.h"

namespace prescene::simulation {
namespace {

// Added to the diagonal of a block, as a share of it: two directions that are the same but for rounding.
constexpr btScalar kBlockRegular = 1e-12;

template <std::size_t N>
using Square = std::array<std::array<btScalar, N>, N>;

/// The lower triangular L with L L^T = A, in A's place.
template <std::size_t N>
void factorise(Square<N>& A) {
  for (std::size_t i = 0; i < N; ++i) {
    A[i][i] *= 1.0 + kBlockRegular;
    for (std::size_t j = 0; j <= i; ++j) {
      btScalar sum = A[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= A[i][k] * A[j][k];
      A[i][j] = i == j ? std::sqrt(std::max(sum, 1e-300)) : sum / A[j][j];
    }
  }
}

/// x with L L^T x = b, in b's place.
template <std::size_t N>
void solve_factorised(const Square<N>& L, std::array<btScalar, N>& b) {
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= L[i][k] * b[k];
    b[i] /= L[i][i];
  }
  for (std::size_t i = N; i-- > 0;) {
    for (std::size_t k = i + 1; k < N; ++k) b[i] -= L[k][i] * b[k];
    b[i] /= L[i][i];
  }
}

}  // namespace

ContactSolver::JointRows ContactSolver::make_joint(const SolverJoint& given) const {
  JointRows joint;
  joint.a = body_ids_[static_cast<std::size_t>(given.body_a)];
  joint.b = body_ids_[static_cast<std::size_t>(given.body_b)];
  const btSolverBody& a = m_tmpSolverBodyPool[joint.a];
  const btSolverBody& b = m_tmpSolverBodyPool[joint.b];
  const btVector3 point = to_bullet(given.point);
  const btVector3 none(0, 0, 0);
  const btVector3 arm_a = a.m_originalBody ? point - a.m_worldTransform.getOrigin() : none;
  const btVector3 arm_b = b.m_originalBody ? point - b.m_worldTransform.getOrigin() : none;
  const auto linear = [&](const Vector3d& direction) { return make_row(to_bullet(direction), arm_a, arm_b, a, b); };
  const auto angular = [&](const Vector3d& about) {
    Row row;
    row.direction = none;
    row.torque_a = row.torque_b = to_bullet(about);
    row.turn_a = a.m_originalBody ? a.m_originalBody->getInvInertiaTensorWorld() * row.torque_a : none;
    row.turn_b = b.m_originalBody ? b.m_originalBody->getInvInertiaTensorWorld() * row.torque_b : none;
    row.response = row.turn_a.dot(row.torque_a) + row.turn_b.dot(row.torque_b);
    return row;
  };
  if (given.hinge) {
    joint.held = {linear(Vector3d::UnitX()), linear(Vector3d::UnitY()), linear(Vector3d::UnitZ()),
                  angular(given.across_1), angular(given.across_2)};
    joint.axis = angular(given.axis);
  } else {
    joint.held = {linear(given.across_1), linear(given.across_2), angular(Vector3d::UnitX()),
                  angular(Vector3d::UnitY()), angular(Vector3d::UnitZ())};
    joint.axis = linear(given.axis);
  }
  const btScalar inverse_masses = a.internalGetInvMass().x() + b.internalGetInvMass().x();
  const auto coupling = [&](const Row& i, const Row& j) {
    return inverse_masses * i.direction.dot(j.direction) + i.turn_a.dot(j.torque_a) + i.turn_b.dot(j.torque_b);
  };
  for (std::size_t i = 0; i < kHeld; ++i) {
    for (std::size_t j = 0; j < kHeld; ++j) joint.factor[i][j] = coupling(joint.held[i], joint.held[j]);
    joint.along[i] = coupling(joint.held[i], joint.axis);
  }
  const std::array<btScalar, kHeld> felt = joint.along;
  factorise(joint.factor);
  solve_factorised(joint.factor, joint.along);
  joint.response = joint.axis.response;
  for (std::size_t i = 0; i < kHeld; ++i) {
    joint.response -= felt[i] * joint.along[i];
    joint.along[i] = -joint.along[i];
  }
  return joint;
}

void ContactSolver::apply_joint(const JointRows& joint, std::size_t row, btScalar impulse) {
  apply(joint.held[row], impulse, m_tmpSolverBodyPool[joint.a], m_tmpSolverBodyPool[joint.b]);
}

void ContactSolver::apply_axis(const JointRows& joint, btScalar impulse) {
  apply(joint.axis, impulse, m_tmpSolverBodyPool[joint.a], m_tmpSolverBodyPool[joint.b]);
  for (std::size_t i = 0; i < kHeld; ++i) apply_joint(joint, i, impulse * joint.along[i]);
}

void ContactSolver::make_joints() {
  joints_.clear();
  for (const SolverJoint& given : given_joints_) {
    const JointRows joint = make_joint(given);
    for (std::size_t i = 0; i < kHeld; ++i) apply_joint(joint, i, given.impulse[i]);
    apply_axis(joint, given.impulse[kHeld]);
    joints_.push_back(joint);
  }
}

btScalar ContactSolver::solve_joints() {
  btScalar change = 0.0;
  for (std::size_t j = 0; j < joints_.size(); ++j) change = std::max(change, solve_joint(joints_[j], given_joints_[j]));
  return change;
}

btScalar ContactSolver::solve_joint(JointRows& joint, SolverJoint& given) {
  const btSolverBody& a = m_tmpSolverBodyPool[joint.a];
  const btSolverBody& b = m_tmpSolverBodyPool[joint.b];
  const auto speed = [&](const Row& row) { return relative_velocity(row.direction, row.torque_a, row.torque_b, a, b); };
  btScalar most = 0.0;
  std::array<btScalar, kHeld> impulse;
  for (std::size_t i = 0; i < kHeld; ++i) {
    impulse[i] = given.target[i] - speed(joint.held[i]);
    const bool angular = joint.held[i].direction.isZero();
    most = std::max(most, std::abs(impulse[i]) * (angular ? given.arm : 1.0));
  }
  solve_factorised(joint.factor, impulse);
  for (std::size_t i = 0; i < kHeld; ++i) {
    given.impulse[i] += impulse[i];
    apply_joint(joint, i, impulse[i]);
  }
  // Along the axis: the rate that it would have without an impulse of its own, then what friction, damping (both as
  // they are at the end of the step) and the limits make of it.
  const btScalar rate = speed(joint.axis);
  const btScalar unresisted = rate - joint.response * given.impulse[kHeld];
  const btScalar slowed = std::max(0.0, std::abs(unresisted) - joint.response * given.friction * dt_) /
                          (1.0 + joint.response * given.damping * dt_);
  const btScalar wanted = std::clamp(std::copysign(slowed, unresisted), given.least_rate, given.most_rate);
  const btScalar total = (wanted - unresisted) / joint.response;
  apply_axis(joint, total - given.impulse[kHeld]);
  given.impulse[kHeld] = total;
  return std::max(most, std::abs(wanted - rate) * (given.hinge ? given.arm : 1.0));
}

bool ContactSolver::joints_push() const {
  return std::any_of(given_joints_.begin(), given_joints_.end(), [](const SolverJoint& joint) {
    return joint.push_rate != 0.0 ||
           std::any_of(joint.push_target.begin(), joint.push_target.end(), [](double target) { return target != 0.0; });
  });
}

btScalar ContactSolver::solve_joint_push(JointRows& joint, const SolverJoint& given) {
  btSolverBody& a = m_tmpSolverBodyPool[joint.a];
  btSolverBody& b = m_tmpSolverBodyPool[joint.b];
  const auto speed = [&](const Row& row) {
    return row.direction.dot(a.m_pushVelocity - b.m_pushVelocity) + row.torque_a.dot(a.m_turnVelocity) -
           row.torque_b.dot(b.m_turnVelocity);
  };
  const auto push = [&](const Row& row, btScalar impulse) {
    a.m_pushVelocity += row.direction * (impulse * a.internalGetInvMass().x());
    a.m_turnVelocity += row.turn_a * impulse;
    b.m_pushVelocity -= row.direction * (impulse * b.internalGetInvMass().x());
    b.m_turnVelocity -= row.turn_b * impulse;
  };
  btScalar most = 0.0;
  std::array<btScalar, kHeld> impulse;
  for (std::size_t i = 0; i < kHeld; ++i) {
    impulse[i] = given.push_target[i] - speed(joint.held[i]);
    most = std::max(most, std::abs(impulse[i]) * (joint.held[i].direction.isZero() ? given.arm : 1.0));
  }
  solve_factorised(joint.factor, impulse);
  for (std::size_t i = 0; i < kHeld; ++i) push(joint.held[i], impulse[i]);
  if (given.push_rate == 0.0) return most;
  // One-sided: what pushes it back otherwise may do so.
  const btScalar sign = given.push_rate > 0.0 ? 1.0 : -1.0;
  const btScalar missing = given.push_rate - speed(joint.axis);
  const btScalar total = sign * std::max(0.0, sign * (joint.push_impulse + missing / joint.response));
  const btScalar more = total - joint.push_impulse;
  joint.push_impulse = total;
  push(joint.axis, more);
  for (std::size_t i = 0; i < kHeld; ++i) push(joint.held[i], more * joint.along[i]);
  return std::max(most, std::abs(more) * joint.response * (given.hinge ? given.arm : 1.0));
}

}  // namespace prescene::simulation
