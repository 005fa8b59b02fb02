// SPDX-License-Identifier: Apache-2.0
// Joint positions as the belief has them.
#include <cmath>
#include <numbers>

#include "prescene/belief/belief.h"
#include "prescene/belief/joint.h"
#include "prescene/core/check.h"

namespace prescene::belief {
namespace {

// Of numeric derivatives, rad and m.
constexpr double kDerivativeStep = 1e-5;

Matrix6d pose_covariance(const Particle& particle) { return particle.covariance.topLeftCorner<6, 6>(); }

/// Variance of the joint's position that comes of one pose's covariance. `position` is a function of that pose.
template <class Position>
double carried_variance(const Position& position, const Pose& X, const Matrix6d& covariance) {
  Vector6d slope;
  for (int k = 0; k < 6; ++k) {
    const Vector6d step = kDerivativeStep * Vector6d::Unit(k);
    slope[k] = (position(geometry::box_plus(X, step)) - position(geometry::box_plus(X, -step))) / (2 * kDerivativeStep);
  }
  return slope.dot(covariance * slope);
}

JointEstimate estimate_of(const Belief& belief, const Joint& joint, const ObjectBelief& child,
                          const ObjectBelief* parent) {
  const Scene& scene = *belief.scene;
  JointEstimate result{joint.name, joint.type, 0.0, 0.0, 0.0, joint.low, joint.high, 0.0};
  Pose X_WP;
  Twist V_WP;
  double parent_confidence = 1.0;
  if (parent) {
    const Particle& heavy = heaviest(parent->particles);
    X_WP = heavy.X_WO;
    V_WP = heavy.V_WO;
    parent_confidence = estimate(belief, *parent).confidence;
  } else if (const auto support = find_support(scene, joint.parent)) {
    X_WP = scene.supports[static_cast<std::size_t>(*support)].X_WS;
  }
  result.confidence = parent_confidence * estimate(belief, child).confidence;

  // Of the mixture; of a hinge without limits within half a turn of the heaviest particle's position.
  const bool wraps = joint.type == JointType::kHinge && std::isinf(joint.low);
  const Particle& heaviest_of_child = heaviest(child.particles);
  const double about = joint_state(joint, X_WP, Twist{}, heaviest_of_child.X_WO, Twist{}).position;
  const auto near = [&](double position, double reference) {
    return wraps ? reference + std::remainder(position - reference, 2.0 * std::numbers::pi) : position;
  };
  double weights = 0.0, first = 0.0, second = 0.0;
  for (const Particle& particle : child.particles) {
    const double weight = std::exp(particle.log_weight);
    const JointState at = joint_state(joint, X_WP, V_WP, particle.X_WO, particle.V_WO);
    const double here = near(at.position, about);
    const auto position = [&](const Pose& X_WC) {
      return near(joint_state(joint, X_WP, Twist{}, X_WC, Twist{}).position, here);
    };
    const double spread = carried_variance(position, particle.X_WO, pose_covariance(particle));
    weights += weight;
    first += weight * here;
    second += weight * (here * here + spread);
    result.velocity += weight * at.velocity;
  }
  if (!(weights > 0.0)) return result;
  result.position = first / weights;
  result.velocity /= weights;
  double variance = std::max(0.0, second / weights - result.position * result.position);
  if (parent) {
    // The two poses count as independent, so the spread is rather too wide.
    const auto position = [&](const Pose& X) {
      return near(joint_state(joint, X, Twist{}, heaviest_of_child.X_WO, Twist{}).position, about);
    };
    variance += carried_variance(position, X_WP, pose_covariance(heaviest(parent->particles)));
  }
  result.standard_deviation = std::sqrt(variance);
  result.position = near(result.position, 0.0);
  return result;
}

}  // namespace

std::vector<JointEstimate> joint_estimates(const Belief& belief) {
  std::vector<JointEstimate> estimates;
  if (!belief.scene) return estimates;
  const auto object_of = [&](const std::string& name) -> const ObjectBelief* {
    const std::optional<int> index = find_object(belief, name);
    if (!index) return nullptr;
    const ObjectBelief& object = belief.objects[static_cast<std::size_t>(*index)];
    return object.particles.empty() ? nullptr : &object;
  };
  for (const Joint& joint : belief.scene->joints) {
    const ObjectBelief* child = object_of(joint.child);
    const ObjectBelief* parent = object_of(joint.parent);
    const bool fixed_parent = joint.parent.empty() || find_support(*belief.scene, joint.parent);
    if (child && (parent || fixed_parent)) estimates.push_back(estimate_of(belief, joint, *child, parent));
  }
  return estimates;
}

std::vector<JointEstimate> joint_estimates(const Scene& scene) {
  Belief belief;
  belief.scene = std::make_shared<const Scene>(scene);
  for (const SceneObject& object : scene.objects) {
    Particle particle;
    particle.X_WO = mean(object.pose);
    particle.V_WO = mean(object.twist);
    particle.covariance.topLeftCorner<6, 6>() = covariance(object.pose);
    ObjectBelief& made = belief.objects.emplace_back();
    made.name = object.name;
    made.model = object.model;
    made.particles = {particle};
  }
  return joint_estimates(belief);
}

}  // namespace prescene::belief
