// SPDX-License-Identifier: Apache-2.0
// InstanceWorld: joints. The velocities of a step are chosen so that the joints hold where the step ends, not only as
// it begins (SHAKE of molecular dynamics, Ryckaert et al. 1977): a pendulum then keeps its energy at any step, where
// velocities along the tangent lose (angle of a step)^2 / 2 of themselves a step.
#include <algorithm>
#include <cmath>

#include "body_motion.h"
#include "instance_world.h"

namespace prescene::simulation {
namespace {

// m and rad: joints that are off by less at the end of a step hold.
constexpr double kAim = 1e-9;
// The error shrinks by the square of the angle of a step each time.
constexpr int kMostAims = 4;

}  // namespace

bool InstanceWorld::joint_acts(const CompiledJoint& joint) const {
  const auto moves = [&](int body) { return body >= 0 && moving_[static_cast<std::size_t>(body)].dynamic; };
  return moves(joint.child) || moves(joint.parent);
}

Frame InstanceWorld::parent_frame(const CompiledJoint& joint) const {
  return joint.parent < 0 ? Frame() : moving_[static_cast<std::size_t>(joint.parent)].X_WO;
}

Pose InstanceWorld::end_pose(int index) const {
  if (index < 0) return {};
  const auto i = static_cast<std::size_t>(index);
  const Moving& m = moving_[i];
  if (!m.dynamic)
    return {geometry::exp_rotation(part_ * m.spin) * Quaterniond(m.X_WO.R), m.X_WO.p + part_ * m.velocity};
  const Object& object = objects_[i];
  const Quaterniond R = spun(object.R_WO, from_bullet(rigid_[i]->getAngularVelocity()), scene_->bodies[i], part_).R_WO;
  const Vector3d p = object.p_WCm + part_ * from_bullet(rigid_[i]->getLinearVelocity());
  return {R, p - R * object.physical.center_of_mass};
}

std::array<double, 5> InstanceWorld::joint_errors(const CompiledJoint& joint, const SolverJoint& rows, const Pose& X_WP,
                                                  const Pose& X_WC) const {
  const Vector3d off = X_WC * joint.anchor_C - X_WP * joint.joint.anchor_P;
  const Quaterniond R_WC0 = X_WP.rotation * joint.joint.X_PC0.rotation;
  const Quaterniond turn = X_WC.rotation * R_WC0.conjugate();
  if (rows.hinge) {
    const Vector3d axis = X_WP.rotation * joint.joint.axis_P;
    const Vector3d tilt = axis.cross(turn * axis);
    return {off.x(), off.y(), off.z(), tilt.dot(rows.across_1), tilt.dot(rows.across_2)};
  }
  const Vector3d angle = geometry::log_rotation(turn);
  return {off.dot(X_WP.rotation * joint.across_1_P), off.dot(X_WP.rotation * joint.across_2_P), angle.x(), angle.y(),
          angle.z()};
}

void InstanceWorld::list_joints() {
  joints_.clear();
  joint_ids_.clear();
  begun_.clear();
  const double recovery = scene_->options.overlap_recovery / part_;
  for (std::size_t j = 0; j < scene_->joints.size(); ++j) {
    const CompiledJoint& joint = scene_->joints[j];
    if (!joint_acts(joint)) continue;
    const Frame P = parent_frame(joint);
    const Frame& C = moving_[static_cast<std::size_t>(joint.child)].X_WO;
    const Pose X_WP{Quaterniond(P.R), P.p}, X_WC{Quaterniond(C.R), C.p};
    SolverJoint rows;
    rows.body_a = joint.child;
    rows.body_b = joint.parent < 0 ? body_count() : joint.parent;
    rows.hinge = joint.joint.type == belief::JointType::kHinge;
    rows.point = C * joint.anchor_C;
    rows.axis = P.R * joint.joint.axis_P;
    rows.across_1 = P.R * joint.across_1_P;
    rows.across_2 = P.R * joint.across_2_P;
    rows.arm = joint.arm;
    rows.friction = hinged_[j].drawn.friction;
    rows.damping = hinged_[j].drawn.damping;
    const double position = belief::joint_state(joint.joint, X_WP, {}, X_WC, {}).position;
    // What is beyond a limit does not go on, and is brought back without speed.
    rows.least_rate = std::min(0.0, joint.joint.low - position) / part_;
    rows.most_rate = std::max(0.0, joint.joint.high - position) / part_;
    rows.push_rate = recovery * (std::clamp(position, joint.joint.low, joint.joint.high) - position);
    if (std::abs(rows.push_rate) < recovery * kAim) rows.push_rate = 0.0;
    rows.impulse = hinged_[j].impulse;
    for (double& impulse : rows.impulse) impulse *= share();
    begun_.push_back(joint_errors(joint, rows, X_WP, X_WC));
    for (std::size_t k = 0; k < rows.target.size(); ++k)
      rows.push_target[k] = std::abs(begun_.back()[k]) > kAim ? -recovery * begun_.back()[k] : 0.0;
    joints_.push_back(rows);
    joint_ids_.push_back(j);
  }
}

bool InstanceWorld::aim_joints() {
  bool off = false;
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const CompiledJoint& joint = scene_->joints[joint_ids_[k]];
    const std::array<double, 5> ends = joint_errors(joint, joints_[k], end_pose(joint.parent), end_pose(joint.child));
    for (std::size_t i = 0; i < ends.size(); ++i) {
      const double missed = ends[i] - begun_[k][i];
      joints_[k].target[i] -= missed / part_;
      off = off || std::abs(missed) > kAim;
    }
  }
  return off;
}

bool InstanceWorld::solve_with_joints(const core::Cancellation* cancellation) {
  if (!joints_.empty()) found_.assign(contacts_.begin(), contacts_.end());
  for (int aims = 0;; ++aims) {
    fill_bodies();
    if (!solver_.solve_step(rigid_pointers_, contacts_, joints_, settings_, part_, results_, cancellation))
      return false;
    if (joints_.empty() || aims == kMostAims || !aim_joints()) break;
    // Contacts start anew: of one that hits, the impulse found would pass for what the body did before it.
    for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i] = found_[i];
  }
  for (std::size_t k = 0; k < joints_.size(); ++k) hinged_[joint_ids_[k]].impulse = joints_[k].impulse;
  return true;
}

void InstanceWorld::integrate_jointed(int index) {
  const auto i = static_cast<std::size_t>(index);
  Object& object = objects_[i];
  const BodyResult& result = results_[i];
  object.v_WCm = from_bullet(rigid_[i]->getLinearVelocity());
  object.p_WCm += part_ * (object.v_WCm + result.push);
  const CompiledBody& body = scene_->bodies[i];
  Spin spin = spun(object.R_WO, from_bullet(rigid_[i]->getAngularVelocity()), body, part_);
  if (!result.turn.isZero(0.0)) spin = turned(spin, part_ * result.turn, body);
  object.R_WO = spin.R_WO;
  object.w_WO = spin.w_WO;
}

bool InstanceWorld::jointed(int object) const { return jointed_[static_cast<std::size_t>(object)] != 0; }

int InstanceWorld::joint_of(int object) const {
  for (std::size_t j = 0; j < scene_->joints.size(); ++j)
    if (scene_->joints[j].child == object) return static_cast<int>(j);
  return -1;
}

void InstanceWorld::turn_tree(int index, const Quaterniond& turn, const Vector3d& about_W) {
  Object& object = objects_[static_cast<std::size_t>(index)];
  object.R_WO = (turn * object.R_WO).normalized();
  object.p_WCm = about_W + turn * (object.p_WCm - about_W);
  object.v_WCm.setZero();
  object.w_WO.setZero();
  for (const CompiledJoint& joint : scene_->joints)
    if (joint.parent == index) turn_tree(joint.child, turn, about_W);
}

void InstanceWorld::nudge_joint(int index, double angle) {
  const CompiledJoint& joint = scene_->joints[static_cast<std::size_t>(index)];
  const Frame P = parent_frame(joint);
  const Vector3d axis_W = P.R * joint.joint.axis_P;
  turn_tree(joint.child, geometry::exp_rotation(angle * axis_W), P * joint.joint.anchor_P);
}

double InstanceWorld::swing_radius(int index) const {
  const CompiledJoint& joint = scene_->joints[static_cast<std::size_t>(index)];
  const Frame P = parent_frame(joint);
  const Vector3d arm = center_of_mass(joint.child) - P * joint.joint.anchor_P;
  return (P.R * joint.joint.axis_P).cross(arm).norm();
}

}  // namespace prescene::simulation
