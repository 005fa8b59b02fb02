// SPDX-License-Identifier: Apache-2.0
// Bullet's sequential impulse solver with contact rows of our own. Joints stay Bullet's; for contacts it differs in:
//   - a round friction cone solved as one two-dimensional block, so that friction opposes the slip however it turns
//     during the impact (Bullet fixes the directions beforehand);
//   - Newton's restitution measured on the velocity before the step's gravity, so a gap that closes within the step
//     loses nothing and a body at rest does not bounce;
//   - a gap that stays open only limits the approach to what closes it (no impulse at a distance);
//   - overlap is pushed out by pseudo velocities that add no energy;
//   - warm starts come with the contacts, so that a step is a function of its arguments; where they spoil a step it is
//     solved without them.
#pragma once

#include <BulletDynamics/ConstraintSolver/btContactSolverInfo.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

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
  double turning = 0.0;  ///< m/s, in speed_before: what the turning of the bodies adds (ContactPoint::turning).
  /// In: the impulses of the step before (N s). Out: this step's.
  double impulse = 0.0;
  Vector3d friction_impulse = Vector3d::Zero();
  /// Out: the contact closed in this step, so its impulse says nothing about the next step; and it bounced.
  bool hit = false;
  bool bounced = false;
  /// Out, of a hit: when within the step the gap closed, s.
  double hit_time = 0.0;
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

class ContactSolver : public btSequentialImpulseConstraintSolver {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// Changes the velocities of `bodies` (gravity already added) so that the contacts hold at the end of a step of `dt`
  /// seconds. results.size() == bodies.size(). No allocation once the pools have grown. False when it was cancelled
  /// between two iterations: the velocities are of no use then.
  bool solve_step(std::span<btCollisionObject*> bodies, std::span<SolverContact> contacts,
                  const SolverSettings& settings, double dt, std::span<BodyResult> results,
                  const core::Cancellation* cancellation);

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

  std::vector<Contact> rows_;
  std::vector<int> body_ids_;  // solver body of each body of the step
  std::span<btCollisionObject*> bodies_;
  std::span<SolverContact> given_;
  std::span<BodyResult> results_;
  SolverSettings settings_;
  const core::Cancellation* cancellation_ = nullptr;
  bool cancelled_ = false;
};

}  // namespace prescene::simulation
