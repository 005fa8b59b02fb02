// SPDX-License-Identifier: Apache-2.0
// Bullet's sequential impulse solver with rows of our own for contacts and joints (solver_joints.cc). For contacts it
// differs in:
//   - a round friction cone solved as one two-dimensional block, so that friction opposes the slip however it turns
//     during the impact (Bullet fixes the directions beforehand);
//   - Newton's restitution measured on the velocity before the step's gravity, so a gap that closes within the step
//     loses nothing and a body at rest does not bounce;
//   - a gap that stays open only limits the approach to what closes it (no impulse at a distance);
//   - overlap is pushed out by pseudo velocities that add no energy;
//   - warm starts come with the contacts, so that a step is a function of its arguments; where they spoil a step it is
//     solved without them.
// Joints hold five directions at once, exactly but for other joints and contacts; what their friction, damping and
// limits do along the sixth is solved with the inertia that is felt there. Errors of pose are taken away by pseudo
// velocities, so that no joint adds energy.
#pragma once

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "bullet_types.h"
#include "prescene/core/progress.h"

namespace prescene::simulation {

/// One contact point of a step. Vectors in W.
struct SolverContact {
  int body_a = 0;  ///< Index into the bodies of the step.
  int body_b = 0;
  Vector3d position = Vector3d::Zero();
  Vector3d normal = Vector3d::UnitZ();  ///< From B to A.
  double gap = 0.0;                     ///< m
  double friction = 0.0;                ///< While the contact slides or sticks.
  double impact_friction = 0.0;         ///< While it closes faster than SolverSettings::impact_speed.
  double restitution = 0.0;
  double rolling_arm = 0.0;  ///< m
  /// Normal velocity (A minus B) before this step's gravity, m/s; negative while closing.
  double speed_before = 0.0;
  double fall = 0.0;          ///< m/s: what gravity still adds to the normal velocity until the step ends.
  double acceleration = 0.0;  ///< m/s^2: of the normal velocity while nothing presses.
  double turning = 0.0;       ///< m/s, in speed_before: what the turning of the bodies adds (ContactPoint::turning).
  /// In: the impulses of the step before (N s). Out: this step's.
  double impulse = 0.0;
  Vector3d friction_impulse = Vector3d::Zero();
  /// It closes in this step, so its impulse says nothing about the next step. Out: and presses.
  bool hit = false;
  bool bounced = false;  ///< Out.
  /// Out, of a hit: when within the step the gap closed, s.
  double hit_time = 0.0;
};

/// Whether the gap closes within `dt` seconds if nothing presses.
inline bool closes(const SolverContact& c, double dt) {
  return c.gap + dt * (c.speed_before + 0.5 * (dt * c.acceleration - c.turning)) < 0.0;
}

/// One joint of a step. A is the child, B the parent. Vectors in W.
struct SolverJoint {
  int body_a = 0;  ///< Index into the bodies of the step.
  int body_b = 0;
  bool hinge = true;                      ///< Else a slider.
  Vector3d point = Vector3d::Zero();      ///< Where it acts on both.
  Vector3d axis = Vector3d::UnitZ();      ///< Free.
  Vector3d across_1 = Vector3d::UnitX();  ///< With across_2 and the axis an orthonormal frame.
  Vector3d across_2 = Vector3d::UnitY();
  double arm = 0.1;       ///< m: rad/s times this count as m/s when it is asked whether anything changes.
  double friction = 0.0;  ///< N m or N.
  double damping = 0.0;   ///< N m s/rad or N s/m.
  double least_rate = -std::numeric_limits<double>::infinity();  ///< rad/s or m/s along the axis: of the limits.
  double most_rate = std::numeric_limits<double>::infinity();
  /// Velocities wanted in the directions that are held, m/s and rad/s: of a hinge along W's x, y, z at the point, then
  /// about across_1 and 2; of a slider along across_1 and 2, then about x, y, z.
  std::array<double, 5> target{};
  std::array<double, 5> push_target{};  ///< The same of the pseudo velocities.
  double push_rate = 0.0;               ///< Pseudo velocity along the axis that takes an overshoot of a limit away.
  /// In: the impulses of the step before, N s and N m s, in the directions of `target`, then along the axis. Out: this
  /// step's.
  std::array<double, 6> impulse{};
};

struct SolverSettings {
  int iterations = 60;
  double converged = 1e-6;          ///< m/s: iterations end when no contact changes its velocity by more.
  double overlap_recovery = 0.2;    ///< Share of an overlap that is pushed out in a step, in (0, 1].
  double restitution_speed = 0.02;  ///< m/s: contacts closing slower neither hit nor bounce.
  double impact_speed = 0.2;        ///< m/s: contacts closing faster slide with the impact friction.
};

/// What a step did to one body.
struct BodyResult {
  Vector3d push = Vector3d::Zero();  ///< Pseudo velocity that takes overlap away, m/s and rad/s.
  Vector3d turn = Vector3d::Zero();
  bool touched = false;  ///< Some contact pressed on it.
};

/// Of A against B along a row.
inline btScalar relative_velocity(const btVector3& direction, const btVector3& torque_a, const btVector3& torque_b,
                                  const btSolverBody& a, const btSolverBody& b) {
  return direction.dot(a.m_linearVelocity + a.m_deltaLinearVelocity - b.m_linearVelocity - b.m_deltaLinearVelocity) +
         torque_a.dot(a.m_angularVelocity + a.m_deltaAngularVelocity) -
         torque_b.dot(b.m_angularVelocity + b.m_deltaAngularVelocity);
}

class ContactSolver : public btSequentialImpulseConstraintSolver {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// Changes the velocities of `bodies` (gravity already added) so that contacts and joints hold at the end of a step
  /// of `dt` seconds. results.size() == bodies.size(). No allocation once the pools have grown. False when it was
  /// cancelled between two iterations: the velocities are of no use then.
  bool solve_step(std::span<btCollisionObject*> bodies, std::span<SolverContact> contacts,
                  std::span<SolverJoint> joints, const SolverSettings& settings, double dt,
                  std::span<BodyResult> results, const core::Cancellation* cancellation);

 protected:
  void convertContacts(btPersistentManifold** manifolds, int count, const btContactSolverInfo& info) override;
  btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                btPersistentManifold** manifolds, int manifold_count, btTypedConstraint** constraints,
                                int constraint_count, const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  void solveGroupCacheFriendlySplitImpulseIterations(btCollisionObject** bodies, int body_count,
                                                     btPersistentManifold** manifolds, int manifold_count,
                                                     btTypedConstraint** constraints, int constraint_count,
                                                     const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int body_count,
                                         const btContactSolverInfo& info) override;

 private:
  /// Effect of a unit impulse along one direction at the contact point, on A and opposite on B.
  struct Row {
    btVector3 direction;
    btVector3 torque_a, torque_b;  // arm x direction
    btVector3 turn_a, turn_b;      // inverse inertia times torque
    btScalar response = 0.0;       // change of the relative velocity along `direction`
    btScalar impulse = 0.0;
  };
  struct Contact {
    int a = 0, b = 0;  // solver bodies
    Row normal, tangent_1, tangent_2;
    btScalar target = 0.0;       // lower bound of the normal velocity
    btScalar push_target = 0.0;  // lower bound of the normal pseudo velocity
    btScalar push_impulse = 0.0;
    btScalar mu = 0.0;
    btScalar slip_step = 0.0;    // 1 / largest eigenvalue of the tangential response
    btScalar rolling_arm = 0.0;  // m
    btScalar rolling_step = 0.0;
    btVector3 rolling_impulse;  // N m s
    bool hit = false;
    bool bounced = false;
    btScalar hit_time = 0.0;
  };

  static constexpr std::size_t kHeld = 5;
  struct JointRows {
    int a = 0, b = 0;  // solver bodies
    std::array<Row, kHeld> held;
    Row axis;
    std::array<std::array<btScalar, kHeld>, kHeld> factor{};  // of the held rows' response: L with L L^T
    std::array<btScalar, kHeld> along{};  // impulses of the held rows that go with one along the axis
    btScalar response = 0.0;              // along the axis, the others held
    btScalar push_impulse = 0.0;
  };

  /// Whether the step was cancelled.
  bool cut_off();
  Row make_row(const btVector3& direction, const btVector3& arm_a, const btVector3& arm_b, const btSolverBody& a,
               const btSolverBody& b) const;
  Contact make_contact(const SolverContact& given, btScalar dt);
  void apply(const Row& row, btScalar impulse, btSolverBody& a, btSolverBody& b) const;
  /// Whether the impulses are worse than none: where things are wedged impulses are large, and those of the step before
  /// may fit this step's contacts so badly that the iterations end before the energy of it is taken back.
  bool adds_energy() const;
  void take_back_impulses();
  /// Each returns the largest change of a relative velocity, m/s.
  btScalar solve_contacts();
  btScalar solve_normal(Contact& contact);
  btScalar solve_slip(Contact& contact);
  btScalar solve_rolling(Contact& contact);
  btScalar solve_push(Contact& contact);

  // Joints: solver_joints.cc.
  JointRows make_joint(const SolverJoint& given) const;
  void apply_joint(const JointRows& joint, std::size_t row, btScalar impulse);
  void apply_axis(const JointRows& joint, btScalar impulse);
  void make_joints();
  btScalar solve_joints();
  btScalar solve_joint(JointRows& joint, SolverJoint& given);
  bool joints_push() const;
  btScalar solve_joint_push(JointRows& joint, const SolverJoint& given);

  std::vector<Contact> rows_;
  std::vector<JointRows> joints_;
  std::vector<int> body_ids_;  // solver body of each body of the step
  std::span<btCollisionObject*> bodies_;
  std::span<SolverContact> given_;
  std::span<SolverJoint> given_joints_;
  btScalar dt_ = 0.0;
  std::span<BodyResult> results_;
  SolverSettings settings_;
  const core::Cancellation* cancellation_ = nullptr;
  bool cancelled_ = false;
};

}  // namespace prescene::simulation
