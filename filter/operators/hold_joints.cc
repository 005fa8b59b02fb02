// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/hold_joints.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "falling_particles.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::filter {
namespace {

using belief::Joint;
using belief::JointType;
using belief::ObjectBelief;
using belief::Particle;
using geometry::Matrix6d;
using geometry::Pose;
using geometry::Twist;
using geometry::Vector3d;
using geometry::Vector6d;

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix56d = Eigen::Matrix<double, 5, 6>;

// How exactly real joints are where the scene says, and how exactly velocities obey them: standard deviations. Chosen.
constexpr double kJointShift = 0.001;    // m
constexpr double kJointTurn = 0.009;     // rad
constexpr double kJointSpeed = 0.01;     // m/s
constexpr double kJointRate = 0.05;      // rad/s
constexpr double kMostJointDoubt = 8.0;  // nats; the most that being off may cost a particle; chosen
constexpr double kPoseStep = 1e-5;       // rad and m, of numeric derivatives
constexpr double kTimeStep = 1e-4;       // s
constexpr double kClearTurn = 0.3;       // rad: an equivalent that fits better by less is left
// Off by a large angle, the first update is not yet on the joint.
constexpr int kUpdates = 2;

/// A parent: fixed, or the heaviest particle of an object.
struct Base {
  Pose X_WP;
  Twist V_WP;
  Matrix6d pose_covariance = Matrix6d::Zero();
  Matrix6d twist_covariance = Matrix6d::Zero();
};

std::optional<Base> base_of(const belief::Belief& belief, const Joint& joint) {
  if (joint.parent.empty()) return Base{};
  if (const auto support = belief::find_support(*belief.scene, joint.parent))
    return Base{belief.scene->supports[static_cast<std::size_t>(*support)].X_WS, {}};
  const auto object = belief::find_object(belief, joint.parent);
  if (!object) return std::nullopt;
  const ObjectBelief& parent = belief.objects[static_cast<std::size_t>(*object)];
  if (parent.particles.empty() || !is_present(parent)) return std::nullopt;
  const Particle& heavy = belief::heaviest(parent.particles);
  return Base{heavy.X_WO, heavy.V_WO, heavy.covariance.topLeftCorner<6, 6>(),
              heavy.covariance.bottomRightCorner<6, 6>()};
}

/// How far the child is off in the directions that are held, in axes of the parent: first metres (three of a hinge, two
/// of a slider), then radians.
Vector5d off_joint(const Joint& joint, const Pose& X_WP, const Pose& X_WC) {
  const Pose X_PC = X_WP.inverse() * X_WC;
  const Vector3d off = X_PC * (joint.X_PC0.inverse() * joint.anchor_P) - joint.anchor_P;
  const geometry::Quaterniond turn = X_PC.rotation * joint.X_PC0.rotation.conjugate();
  const Vector3d u = joint.axis_P.unitOrthogonal(), v = joint.axis_P.cross(u);
  Vector5d result;
  if (joint.type == JointType::kHinge) {
    const Vector3d tilt = joint.axis_P.cross(turn * joint.axis_P);
    result << off, tilt.dot(u), tilt.dot(v);
  } else {
    result << off.dot(u), off.dot(v), geometry::log_rotation(turn);
  }
  return result;
}

/// Derivative by the error coordinates of a pose.
template <class Function>
Matrix56d derivative(const Function& function, const Pose& X) {
  Matrix56d result;
  for (int k = 0; k < 6; ++k) {
    const Vector6d step = kPoseStep * Vector6d::Unit(k);
    result.col(k) = (function(geometry::box_plus(X, step)) - function(geometry::box_plus(X, -step))) / (2 * kPoseStep);
  }
  return result;
}

Pose pose_after(const Pose& X, const Twist& V, double time) {
  return {geometry::exp_rotation(time * V.angular) * X.rotation, X.translation + time * V.linear};
}

/// The derivative by a twist (angular, linear; in W) of what has `slope` by the error coordinates of the pose.
Matrix56d by_twist(const Matrix56d& slope, const Pose& X) {
  Matrix56d result = slope;
  result.leftCols<3>() = slope.leftCols<3>() * X.rotation.toRotationMatrix().transpose();
  return result;
}

/// A Gaussian measurement of linear functions of the twelve error coordinates; returns half the squared innovation.
template <int kRows>
double measure(const Eigen::Matrix<double, kRows, 12>& H, const Eigen::Matrix<double, kRows, 1>& innovation,
               const Eigen::Matrix<double, kRows, kRows>& noise, Particle& particle) {
  const Eigen::Matrix<double, kRows, 12> cross = H * particle.covariance;
  const Eigen::Matrix<double, kRows, kRows> spread = cross * H.transpose() + noise;
  Eigen::Matrix<double, kRows, 13> right;
  right << cross, innovation;
  const Eigen::MatrixXd solved = geometry::solve_symmetric(spread, right);
  const Eigen::Matrix<double, 12, 1> change = cross.transpose() * solved.col(12);
  const belief::Matrix12d after = particle.covariance - cross.transpose() * solved.leftCols(12);
  particle.covariance = 0.5 * (after + after.transpose());
  particle.X_WO = geometry::normalized(geometry::box_plus(particle.X_WO, change.head<6>()));
  particle.V_WO.angular += change.segment<3>(6);
  particle.V_WO.linear += change.tail<3>();
  return 0.5 * innovation.dot(solved.col(12));
}

Vector5d joint_deviations(const Joint& joint, double linear, double angular) {
  Vector5d result = Vector5d::Constant(angular);
  result.head(joint.type == JointType::kHinge ? 3 : 2).setConstant(linear);
  return result;
}

/// Of poses that look alike, the one that its joint allows best.
void take_fitting_equivalent(const Joint& joint, const Base& base, const geometry::SymmetryGroup& symmetry,
                             Particle& particle) {
  if (symmetry.trivial()) return;
  const double position = belief::joint_state(joint, base.X_WP, {}, particle.X_WO, {}).position;
  const Pose allowed = belief::child_pose(joint, base.X_WP, std::clamp(position, joint.low, joint.high));
  const Pose other = geometry::closest_equivalent(particle.X_WO, allowed, symmetry);
  if (geometry::angle_between(other.rotation, allowed.rotation) + kClearTurn >
      geometry::angle_between(particle.X_WO.rotation, allowed.rotation))
    return;
  // Errors of the rotation are in the body's axes, which are others now.
  belief::Matrix12d turn = belief::Matrix12d::Identity();
  turn.topLeftCorner<3, 3>() = (other.rotation.conjugate() * particle.X_WO.rotation).toRotationMatrix();
  particle.covariance = turn * particle.covariance * turn.transpose();
  particle.V_WO = geometry::shifted(particle.V_WO, other.translation - particle.X_WO.translation);
  particle.X_WO = geometry::normalized(other);
}

/// Returns the nats that it costs the particle.
double hold_pose(const Joint& joint, const Base& base, Particle& particle) {
  double nats = 0.0;
  const belief::Matrix12d before = particle.covariance;
  for (int k = 0; k < kUpdates; ++k) {
    // The second time only where the first was not enough: the same measurement counts once.
    const Vector5d off = off_joint(joint, base.X_WP, particle.X_WO);
    const Vector5d sigma = joint_deviations(joint, kJointShift, kJointTurn);
    if (k > 0 && (off.cwiseAbs().array() < sigma.array()).all()) break;
    if (k > 0) particle.covariance = before;
    const auto of_child = [&](const Pose& X) { return off_joint(joint, base.X_WP, X); };
    const auto of_parent = [&](const Pose& X) { return off_joint(joint, X, particle.X_WO); };
    Eigen::Matrix<double, 5, 12> H = Eigen::Matrix<double, 5, 12>::Zero();
    H.leftCols<6>() = derivative(of_child, particle.X_WO);
    const Matrix56d by_parent = derivative(of_parent, base.X_WP);
    Eigen::Matrix<double, 5, 5> noise = by_parent * base.pose_covariance * by_parent.transpose();
    noise.diagonal() += sigma.cwiseAbs2();
    const double cost = measure<5>(H, -off, noise, particle);
    if (k == 0) nats = cost;
  }
  return nats;
}

void hold_twist(const Joint& joint, const Base& base, Particle& particle) {
  const Vector5d now = off_joint(joint, base.X_WP, particle.X_WO);
  const Vector5d then = off_joint(joint, pose_after(base.X_WP, base.V_WP, kTimeStep),
                                  pose_after(particle.X_WO, particle.V_WO, kTimeStep));
  const auto of_child = [&](const Pose& X) { return off_joint(joint, base.X_WP, X); };
  const auto of_parent = [&](const Pose& X) { return off_joint(joint, X, particle.X_WO); };
  Eigen::Matrix<double, 5, 12> H = Eigen::Matrix<double, 5, 12>::Zero();
  H.rightCols<6>() = by_twist(derivative(of_child, particle.X_WO), particle.X_WO);
  const Matrix56d by_parent = by_twist(derivative(of_parent, base.X_WP), base.X_WP);
  Eigen::Matrix<double, 5, 5> noise = by_parent * base.twist_covariance * by_parent.transpose();
  noise.diagonal() += joint_deviations(joint, kJointSpeed, kJointRate).cwiseAbs2();
  measure<5>(H, (now - then) / kTimeStep, noise, particle);
}

/// Beyond a limit: back to it, and not on.
void hold_limits(const Joint& joint, const Base& base, Particle& particle) {
  const auto state = [&](const Pose& X, const Twist& V) {
    return belief::joint_state(joint, base.X_WP, base.V_WP, X, V);
  };
  const belief::JointState at = state(particle.X_WO, particle.V_WO);
  const double allowed = std::clamp(at.position, joint.low, joint.high);
  if (allowed == at.position) return;
  const bool hinge = joint.type == JointType::kHinge;
  Eigen::Matrix<double, 1, 12> by_pose = Eigen::Matrix<double, 1, 12>::Zero(), by_rate = by_pose;
  for (int k = 0; k < 6; ++k) {
    const Vector6d step = kPoseStep * Vector6d::Unit(k);
    by_pose[k] = (state(geometry::box_plus(particle.X_WO, step), {}).position -
                  state(geometry::box_plus(particle.X_WO, -step), {}).position) /
                 (2 * kPoseStep);
  }
  const auto squared = [](double value) { return Eigen::Matrix<double, 1, 1>(value * value); };
  measure<1>(by_pose, Eigen::Matrix<double, 1, 1>(allowed - at.position), squared(hinge ? kJointTurn : kJointShift),
             particle);
  if ((at.position - allowed) * at.velocity <= 0.0) return;
  by_rate.rightCols<6>() = by_pose.leftCols<6>();
  by_rate.segment<3>(6) = by_pose.head<3>() * particle.X_WO.rotation.toRotationMatrix().transpose();
  measure<1>(by_rate, Eigen::Matrix<double, 1, 1>(-at.velocity), squared(hinge ? kJointRate : kJointSpeed), particle);
}

}  // namespace

void hold_joints(belief::Belief& belief) {
  if (belief.scene->joints.empty()) return;
  for (const int j : belief::joint_order(*belief.scene)) {
    const Joint& joint = belief.scene->joints[static_cast<std::size_t>(j)];
    const auto index = belief::find_object(belief, joint.child);
    const std::optional<Base> base = base_of(belief, joint);
    if (!index || !base) continue;
    ObjectBelief& child = belief.objects[static_cast<std::size_t>(*index)];
    if (child.particles.empty() || belief.scene->objects[static_cast<std::size_t>(*index)].held_by) continue;
    double least = kMostJointDoubt;
    std::vector<double> nats;
    for (Particle& particle : child.particles) {
      take_fitting_equivalent(joint, *base, belief::model_of(belief, child).symmetry, particle);
      nats.push_back(std::min(kMostJointDoubt, hold_pose(joint, *base, particle)));
      hold_twist(joint, *base, particle);
      hold_limits(joint, *base, particle);
      least = std::min(least, nats.back());
    }
    for (std::size_t k = 0; k < nats.size(); ++k) child.particles[k].log_weight -= nats[k] - least;
    belief::normalize(child.particles);
  }
}

}  // namespace prescene::filter
