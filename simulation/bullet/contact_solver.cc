// SPDX-License-Identifier: Apache-2.0
#include "contact_solver.h"

#include <algorithm>
#include <cmath>

#include "prescene/core/check.h"

namespace prescene::simulation {
namespace {

// std::hypot guards against overflow, which a step cannot meet, at ten times the cost.
btScalar length_of(btScalar x, btScalar y) { return std::sqrt(x * x + y * y); }

/// When gap + speed t + acceleration t^2 / 2 becomes zero, within [0, dt]; speed < 0 and it does close within dt.
btScalar time_to_close(btScalar gap, btScalar speed, btScalar acceleration, btScalar dt) {
  const btScalar discriminant = speed * speed - 2.0 * acceleration * gap;
  if (discriminant <= 0.0) return dt;
  return std::clamp(2.0 * gap / (-speed + std::sqrt(discriminant)), 0.0, dt);
}

}  // namespace

bool ContactSolver::solve_step(std::span<btCollisionObject*> bodies, std::span<SolverContact> contacts,
                               std::span<SolverJoint> joints, const SolverSettings& settings, double dt,
                               std::span<BodyResult> results, const core::Cancellation* cancellation) {
  PRESCENE_DCHECK(bodies.size() == results.size());
  bodies_ = bodies;
  given_ = contacts;
  given_joints_ = joints;
  dt_ = dt;
  results_ = results;
  settings_ = settings;
  cancellation_ = cancellation;
  cancelled_ = false;
  btContactSolverInfo info;
  info.m_timeStep = dt;
  info.m_numIterations = settings.iterations;
  info.m_leastSquaresResidualThreshold = settings.converged * settings.converged;
  info.m_solverMode = 0;
  info.m_splitImpulse = 0;  // pseudo velocities are handed out in `results`, not applied to Bullet's transforms
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    results[i] = BodyResult{};
    bodies[i]->setCompanionId(-1);
    // Debian's Bullet is built for threads: there kinematic bodies are found by this index.
    bodies[i]->setWorldArrayIndex(static_cast<int>(i));
  }
  solveGroup(bodies.data(), static_cast<int>(bodies.size()), nullptr, 0, nullptr, 0, info, nullptr, nullptr);
  return !cancelled_;
}

ContactSolver::Row ContactSolver::make_row(const btVector3& direction, const btVector3& arm_a, const btVector3& arm_b,
                                           const btSolverBody& a, const btSolverBody& b) const {
  Row row;
  row.direction = direction;
  row.torque_a = arm_a.cross(direction);
  row.torque_b = arm_b.cross(direction);
  row.turn_a.setZero();
  row.turn_b.setZero();
  if (a.m_originalBody) row.turn_a = a.m_originalBody->getInvInertiaTensorWorld() * row.torque_a;
  if (b.m_originalBody) row.turn_b = b.m_originalBody->getInvInertiaTensorWorld() * row.torque_b;
  row.response = a.internalGetInvMass().x() + b.internalGetInvMass().x() + row.turn_a.dot(row.torque_a) +
                 row.turn_b.dot(row.torque_b);
  row.impulse = 0.0;
  return row;
}

void ContactSolver::apply(const Row& row, btScalar impulse, btSolverBody& a, btSolverBody& b) const {
  a.m_deltaLinearVelocity += row.direction * (impulse * a.internalGetInvMass().x());
  a.m_deltaAngularVelocity += row.turn_a * impulse;
  b.m_deltaLinearVelocity -= row.direction * (impulse * b.internalGetInvMass().x());
  b.m_deltaAngularVelocity -= row.turn_b * impulse;
}

ContactSolver::Contact ContactSolver::make_contact(const SolverContact& given, btScalar dt) {
  Contact c;
  c.a = body_ids_[static_cast<std::size_t>(given.body_a)];
  c.b = body_ids_[static_cast<std::size_t>(given.body_b)];
  btSolverBody& a = m_tmpSolverBodyPool[c.a];
  btSolverBody& b = m_tmpSolverBodyPool[c.b];
  const btVector3 n = to_bullet(given.normal);
  const btVector3 position = to_bullet(given.position);
  // Arms end on the bodies' own surfaces, which will have met when the impulse acts. Of two that are free they end
  // midway, or the two would not keep their angular momentum.
  const bool both_free = a.internalGetInvMass().x() > 0.0 && b.internalGetInvMass().x() > 0.0;
  const btVector3 to_surface = n * (both_free ? 0.0 : 0.5 * std::max(0.0, given.gap));
  const btVector3 no_arm(0, 0, 0);
  const btVector3 arm_a = a.m_originalBody ? position + to_surface - a.m_worldTransform.getOrigin() : no_arm;
  const btVector3 arm_b = b.m_originalBody ? position - to_surface - b.m_worldTransform.getOrigin() : no_arm;
  btVector3 t1, t2;
  btPlaneSpace1(n, t1, t2);
  c.normal = make_row(n, arm_a, arm_b, a, b);
  c.tangent_1 = make_row(t1, arm_a, arm_b, a, b);
  c.tangent_2 = make_row(t2, arm_a, arm_b, a, b);
  const btScalar k11 = c.tangent_1.response;
  const btScalar k22 = c.tangent_2.response;
  const btScalar k12 = c.tangent_1.turn_a.dot(c.tangent_2.torque_a) + c.tangent_1.turn_b.dot(c.tangent_2.torque_b);
  c.slip_step = 1.0 / (0.5 * (k11 + k22) + length_of(0.5 * (k11 - k22), k12));
  c.rolling_impulse.setZero();
  c.rolling_arm = given.rolling_arm;
  if (c.rolling_arm > 0.0) {
    btScalar trace = 0.0;
    for (int i = 0; i < 3; ++i) {
      if (a.m_originalBody) trace += a.m_originalBody->getInvInertiaTensorWorld()[i][i];
      if (b.m_originalBody) trace += b.m_originalBody->getInvInertiaTensorWorld()[i][i];
    }
    c.rolling_step = 1.0 / trace;
  }

  const btScalar acceleration = given.acceleration - given.turning / dt;
  c.target = given.gap > 0.0 ? -given.gap / dt : 0.0;
  c.hit = given.hit;
  if (c.hit) {
    // The gap closes at hit_time with the speed it has then; what bounces goes on under gravity until the step ends. A
    // bounce that falls back within the step is none.
    c.hit_time = given.gap > 0.0 ? time_to_close(given.gap, given.speed_before, acceleration, dt) : 0.0;
    const btScalar speed_at_hit = given.speed_before + acceleration * c.hit_time;
    c.target = std::max(0.0, -given.restitution * speed_at_hit + acceleration * (dt - c.hit_time));
    c.bounced = c.target > 0.0;
    if (c.bounced) c.target -= given.fall;
  }
  c.push_target = given.gap > 0.0 ? -given.gap / dt : -given.gap * settings_.overlap_recovery / dt;
  const bool impact = closes(given, dt) && given.speed_before < -settings_.impact_speed;
  c.mu = impact ? given.impact_friction : given.friction;
  return c;
}

void ContactSolver::convertContacts(btPersistentManifold**, int, const btContactSolverInfo& info) {
  body_ids_.clear();
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    body_ids_.push_back(getOrInitSolverBody(*bodies_[i], info.m_timeStep));
  rows_.clear();
  for (const SolverContact& given : given_) {
    Contact c = make_contact(given, info.m_timeStep);
    btSolverBody& a = m_tmpSolverBodyPool[c.a];
    btSolverBody& b = m_tmpSolverBodyPool[c.b];
    c.normal.impulse = given.impulse;
    const btVector3 slip = to_bullet(given.friction_impulse);
    btScalar slip_1 = slip.dot(c.tangent_1.direction);
    btScalar slip_2 = slip.dot(c.tangent_2.direction);
    const btScalar limit = c.mu * c.normal.impulse;
    const btScalar size = length_of(slip_1, slip_2);
    if (size > limit) {
      slip_1 *= limit / size;
      slip_2 *= limit / size;
    }
    c.tangent_1.impulse = slip_1;
    c.tangent_2.impulse = slip_2;
    apply(c.normal, c.normal.impulse, a, b);
    apply(c.tangent_1, slip_1, a, b);
    apply(c.tangent_2, slip_2, a, b);
    rows_.push_back(c);
  }
  make_joints();
}

btScalar ContactSolver::solve_normal(Contact& c) {
  btSolverBody& a = m_tmpSolverBodyPool[c.a];
  btSolverBody& b = m_tmpSolverBodyPool[c.b];
  const btScalar speed = relative_velocity(c.normal.direction, c.normal.torque_a, c.normal.torque_b, a, b);
  const btScalar impulse = std::max(0.0, c.normal.impulse + (c.target - speed) / c.normal.response);
  const btScalar change = impulse - c.normal.impulse;
  if (change == 0.0) return 0.0;
  c.normal.impulse = impulse;
  apply(c.normal, change, a, b);
  return std::abs(change) * c.normal.response;
}

btScalar ContactSolver::solve_slip(Contact& c) {
  const btScalar limit = c.mu * c.normal.impulse;
  if (limit <= 0.0 && c.tangent_1.impulse == 0.0 && c.tangent_2.impulse == 0.0) return 0.0;
  btSolverBody& a = m_tmpSolverBodyPool[c.a];
  btSolverBody& b = m_tmpSolverBodyPool[c.b];
  // A projected gradient step with one step size for both directions: where it stands still, friction is either below
  // its limit with no slip, or at its limit and exactly opposed to the slip.
  const btScalar u1 = relative_velocity(c.tangent_1.direction, c.tangent_1.torque_a, c.tangent_1.torque_b, a, b);
  const btScalar u2 = relative_velocity(c.tangent_2.direction, c.tangent_2.torque_a, c.tangent_2.torque_b, a, b);
  btScalar slip_1 = c.tangent_1.impulse - c.slip_step * u1;
  btScalar slip_2 = c.tangent_2.impulse - c.slip_step * u2;
  const btScalar size = length_of(slip_1, slip_2);
  if (size > limit) {
    slip_1 *= limit / size;
    slip_2 *= limit / size;
  }
  const btScalar change_1 = slip_1 - c.tangent_1.impulse;
  const btScalar change_2 = slip_2 - c.tangent_2.impulse;
  c.tangent_1.impulse = slip_1;
  c.tangent_2.impulse = slip_2;
  apply(c.tangent_1, change_1, a, b);
  apply(c.tangent_2, change_2, a, b);
  return std::max(std::abs(change_1), std::abs(change_2)) / c.slip_step;
}

btScalar ContactSolver::solve_rolling(Contact& c) {
  if (c.rolling_arm <= 0.0) return 0.0;
  btSolverBody& a = m_tmpSolverBodyPool[c.a];
  btSolverBody& b = m_tmpSolverBodyPool[c.b];
  const btVector3 spin =
      a.m_angularVelocity + a.m_deltaAngularVelocity - b.m_angularVelocity - b.m_deltaAngularVelocity;
  btVector3 impulse = c.rolling_impulse - spin * c.rolling_step;
  const btScalar limit = c.rolling_arm * c.normal.impulse;
  const btScalar size = impulse.length();
  if (size > limit) impulse *= limit / size;
  const btVector3 change = impulse - c.rolling_impulse;
  c.rolling_impulse = impulse;
  if (a.m_originalBody) a.m_deltaAngularVelocity += a.m_originalBody->getInvInertiaTensorWorld() * change;
  if (b.m_originalBody) b.m_deltaAngularVelocity -= b.m_originalBody->getInvInertiaTensorWorld() * change;
  return change.length() / c.rolling_step * c.rolling_arm;
}

btScalar ContactSolver::solve_push(Contact& c) {
  btSolverBody& a = m_tmpSolverBodyPool[c.a];
  btSolverBody& b = m_tmpSolverBodyPool[c.b];
  const btScalar speed = c.normal.direction.dot(a.m_pushVelocity - b.m_pushVelocity) +
                         c.normal.torque_a.dot(a.m_turnVelocity) - c.normal.torque_b.dot(b.m_turnVelocity);
  const btScalar impulse = std::max(0.0, c.push_impulse + (c.push_target - speed) / c.normal.response);
  const btScalar change = impulse - c.push_impulse;
  if (change == 0.0) return 0.0;
  c.push_impulse = impulse;
  a.m_pushVelocity += c.normal.direction * (change * a.internalGetInvMass().x());
  a.m_turnVelocity += c.normal.turn_a * change;
  b.m_pushVelocity -= c.normal.direction * (change * b.internalGetInvMass().x());
  b.m_turnVelocity -= c.normal.turn_b * change;
  return std::abs(change) * c.normal.response;
}

void ContactSolver::solveGroupCacheFriendlySplitImpulseIterations(btCollisionObject**, int, btPersistentManifold**, int,
                                                                  btTypedConstraint**, int,
                                                                  const btContactSolverInfo& info, btIDebugDraw*) {
  const bool overlap = std::any_of(rows_.begin(), rows_.end(), [](const Contact& c) { return c.push_target > 0.0; });
  if (!overlap && !joints_push()) return;
  for (int iteration = 0; iteration < info.m_numIterations && !cut_off(); ++iteration) {
    btScalar change = 0.0;
    for (std::size_t j = 0; j < joints_.size(); ++j)
      change = std::max(change, solve_joint_push(joints_[j], given_joints_[j]));
    for (Contact& c : rows_) change = std::max(change, solve_push(c));
    if (change <= settings_.converged) break;
  }
}

btScalar ContactSolver::solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                             btPersistentManifold** manifolds, int manifold_count,
                                             btTypedConstraint** constraints, int constraint_count,
                                             const btContactSolverInfo& info, btIDebugDraw* drawer) {
  if (cut_off()) return 0.0;  // the last iteration
  // Bullet's own pools are empty.
  btScalar residual = btSequentialImpulseConstraintSolver::solveSingleIteration(
      iteration, bodies, body_count, manifolds, manifold_count, constraints, constraint_count, info, drawer);
  btScalar change = solve_joints();
  change = std::max(change, solve_contacts());
  const bool last = iteration + 1 == info.m_numIterations;
  if (last && change > settings_.converged && adds_energy()) {
    take_back_impulses();
    for (int again = 0; again < info.m_numIterations && change > settings_.converged; ++again) {
      change = solve_joints();
      change = std::max(change, solve_contacts());
    }
  }
  return std::max(residual, change * change);
}

bool ContactSolver::cut_off() {
  cancelled_ = cancelled_ || (cancellation_ && cancellation_->requested());
  return cancelled_;
}

btScalar ContactSolver::solve_contacts() {
  btScalar change = 0.0;
  for (Contact& c : rows_) {
    change = std::max(change, solve_normal(c));
    change = std::max(change, solve_slip(c));
    change = std::max(change, solve_rolling(c));
  }
  return change;
}

bool ContactSolver::adds_energy() const {
  btScalar before = 0.0, after = 0.0;
  for (const Contact& c : rows_) {
    const btSolverBody& a = m_tmpSolverBodyPool[c.a];
    const btSolverBody& b = m_tmpSolverBodyPool[c.b];
    for (const Row* row : {&c.normal, &c.tangent_1, &c.tangent_2}) {
      before += row->impulse * (row->direction.dot(a.m_linearVelocity - b.m_linearVelocity) +
                                row->torque_a.dot(a.m_angularVelocity) - row->torque_b.dot(b.m_angularVelocity));
      after += row->impulse * relative_velocity(row->direction, row->torque_a, row->torque_b, a, b);
    }
    before -= c.normal.impulse * c.target;
    after -= c.normal.impulse * c.target;
  }
  // Half their sum is what iterations make smaller and smaller; without any impulse it is 0.
  return before + after > 0.0;
}

void ContactSolver::take_back_impulses() {
  for (Contact& c : rows_) {
    for (Row* row : {&c.normal, &c.tangent_1, &c.tangent_2}) {
      apply(*row, -row->impulse, m_tmpSolverBodyPool[c.a], m_tmpSolverBodyPool[c.b]);
      row->impulse = 0.0;
    }
  }
}

btScalar ContactSolver::solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int body_count,
                                                      const btContactSolverInfo& info) {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Contact& c = rows_[i];
    SolverContact& given = given_[i];
    given.impulse = c.normal.impulse;
    given.friction_impulse =
        from_bullet(c.tangent_1.direction * c.tangent_1.impulse + c.tangent_2.direction * c.tangent_2.impulse);
    given.hit = c.hit && c.normal.impulse > 0.0;
    given.bounced = c.bounced && given.hit;
    given.hit_time = c.hit_time;
    if (c.normal.impulse > 0.0) {
      results_[static_cast<std::size_t>(given.body_a)].touched = true;
      results_[static_cast<std::size_t>(given.body_b)].touched = true;
    }
  }
  for (std::size_t i = 0; i < body_ids_.size(); ++i) {
    const btSolverBody& body = m_tmpSolverBodyPool[body_ids_[i]];
    results_[i].push = from_bullet(body.m_pushVelocity);
    results_[i].turn = from_bullet(body.m_turnVelocity);
  }
  return btSequentialImpulseConstraintSolver::solveGroupCacheFriendlyFinish(bodies, body_count, info);
}

}  // namespace prescene::simulation
