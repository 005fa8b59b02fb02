// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/similarity.h"

#include <cmath>
#include <limits>
#include <type_traits>

namespace prescene::simulation {
namespace {

using belief::ScalarDistribution;
using geometry::Pose;
using geometry::Vector3d;

void scale(double factor, ScalarDistribution& distribution) {
  std::visit(
      [&](auto& d) {
        using T = std::decay_t<decltype(d)>;
        if constexpr (std::is_same_v<T, belief::FixedScalar>) {
          d.value *= factor;
        } else if constexpr (std::is_same_v<T, belief::NormalScalar>) {
          d.mean *= factor;
          d.standard_deviation *= factor;
          d.low *= factor;
          d.high *= factor;
        } else if constexpr (std::is_same_v<T, belief::UniformScalar>) {
          d.low *= factor;
          d.high *= factor;
        } else {
          for (double& sample : d.samples) sample *= factor;
        }
      },
      distribution);
}

void scale(double factor, belief::Vector3Distribution& distribution) {
  for (ScalarDistribution* d : {&distribution.x, &distribution.y, &distribution.z}) scale(factor, *d);
}

void scale(double factor, std::optional<Vector3d>& point) {
  if (point) *point *= factor;
}

void scale(double factor, Pose& pose) { pose.translation *= factor; }

void scale(double factor, belief::PoseDistribution& distribution) {
  std::visit(
      [&](auto& d) {
        using T = std::decay_t<decltype(d)>;
        if constexpr (std::is_same_v<T, belief::FixedPose>) {
          scale(factor, d.X_WO);
        } else if constexpr (std::is_same_v<T, belief::NormalPose>) {
          scale(factor, d.mean);
          d.covariance.template bottomRows<3>() *= factor;
          d.covariance.template rightCols<3>() *= factor;
        } else if constexpr (std::is_same_v<T, belief::BoxPose>) {
          scale(factor, d.position);
        } else {
          for (Pose& sample : d.samples) scale(factor, sample);
        }
      },
      distribution);
}

void scale(const Similarity& similarity, belief::TwistDistribution& distribution) {
  scale(1.0 / similarity.time(), distribution.angular);
  scale(similarity.length / similarity.time(), distribution.linear);
}

void scale(double factor, geometry::Primitive& primitive) {
  std::visit(
      [&](auto& p) {
        if constexpr (std::is_same_v<std::decay_t<decltype(p)>, geometry::BoxShape>) {
          p.size *= factor;
        } else {
          p.radius *= factor;
          if constexpr (requires { p.length; }) p.length *= factor;
        }
      },
      primitive);
}

void scale(double factor, belief::MeshPtr& mesh) {
  if (!mesh) return;
  mesh = std::make_shared<const geometry::TriangleMesh>(geometry::scaled(*mesh, factor));
}

void scale(double factor, std::vector<belief::CollisionShape>& shapes) {
  for (belief::CollisionShape& shape : shapes) {
    std::visit(
        [&](auto& s) {
          scale(factor, s.X_OS);
          if constexpr (requires { s.primitive; }) {
            scale(factor, s.primitive);
          } else {
            scale(factor, s.mesh);
            s.spheres.edge_fidelity *= factor;
          }
        },
        shape);
  }
}

void scale(double factor, belief::ContactProperties& contact) {
  contact.rolling_friction *= factor;
  contact.edge_radius *= factor;
}

void scale(double factor, std::optional<belief::Hollow>& hollow) {
  if (!hollow) return;
  scale(factor, hollow->X_OV);
  hollow->size *= factor;
}

/// Masses stay, and so do forces.
struct JointScale {
  double friction, damping;
};
JointScale scale_of(belief::JointType type, const Similarity& similarity) {
  if (type == belief::JointType::kHinge) return {similarity.length, similarity.length * similarity.time()};
  return {1.0, similarity.time() / similarity.length};
}

}  // namespace

double Similarity::time() const { return std::sqrt(length); }

Similarity similarity_of(const belief::Scene& scene) {
  const double size = belief::smallest_size(scene);
  if (size >= kSmallestAsItIs && size <= kLargestAsItIs) return {};
  return {size / kReferenceSize};
}

belief::Scene scaled(const belief::Scene& scene, const Similarity& similarity) {
  const double length = similarity.length;
  belief::Scene result = scene;
  for (belief::ObjectModel& model : result.models) {
    scale(length, model.collision);
    scale(length, model.visual);
    scale(length, model.center_of_mass);
    model.unit_inertia *= length * length;
    scale(length, model.contact);
    scale(length, model.hollow);
  }
  for (belief::Support& support : result.supports) {
    scale(length, support.collision);
    scale(length, support.visual);
    scale(length, support.X_WS);
    scale(length, support.contact);
    scale(length, support.hollow);
  }
  for (belief::KinematicBody& body : result.robot) {
    scale(length, body.collision);
    scale(length, body.visual);
    scale(length, body.contact);
    for (auto& waypoint : body.timeline) {
      waypoint.time *= similarity.time();
      scale(length, waypoint.X_WG);
    }
  }
  for (belief::SceneObject& object : result.objects) {
    scale(length, object.pose);
    scale(similarity, object.twist);
  }
  for (belief::Joint& joint : result.joints) {
    const bool hinge = joint.type == belief::JointType::kHinge;
    joint.anchor_P *= length;
    scale(length, joint.X_PC0);
    joint.low *= hinge ? 1.0 : length;
    joint.high *= hinge ? 1.0 : length;
    const JointScale factors = scale_of(joint.type, similarity);
    scale(factors.friction, joint.friction);
    scale(factors.damping, joint.damping);
  }
  for (belief::Action& action : result.actions) action = scaled(action, similarity);
  result.duration *= similarity.time();
  return result;
}

belief::Action scaled(const belief::Action& action, const Similarity& similarity) {
  belief::Action result = action;
  result.time *= similarity.time();
  std::visit(
      [&](auto& what) {
        using T = std::decay_t<decltype(what)>;
        if constexpr (requires { what.duration; }) what.duration *= similarity.time();
        if constexpr (requires { what.X_WO; }) scale(similarity.length, what.X_WO);
        if constexpr (std::is_same_v<T, belief::Release>) {
          what.retreat *= similarity.length;
          what.retreat_duration *= similarity.time();
          scale(similarity, what.disturbance);
        } else if constexpr (std::is_same_v<T, belief::Push>) {
          what.from *= similarity.length;
          what.to *= similarity.length;
          what.radius *= similarity.length;
          scale(similarity.length, what.lateral_error);
        } else if constexpr (std::is_same_v<T, belief::Grasp>) {
          if (what.grip) what.grip->pad_length *= similarity.length;
        } else if constexpr (std::is_same_v<T, belief::Bump>) {
          scale(similarity.time(), what.impulse);
          scale(similarity.length, what.point_O);
        } else if constexpr (std::is_same_v<T, belief::Tilt>) {
          what.pivot_O *= similarity.length;
        } else if constexpr (std::is_same_v<T, belief::Pull>) {
          what.by *= similarity.length;
          scale(similarity.length, what.point_O);
        } else if constexpr (std::is_same_v<T, belief::MoveJoint>) {
          if (what.type == belief::JointType::kSlider) what.to *= similarity.length;
          scale(similarity.length, what.handle_C);
        } else if constexpr (std::is_same_v<T, belief::Insert>) {
          what.distance *= similarity.length;
          scale(similarity.length, what.torque);
        }
      },
      result.what);
  return result;
}

belief::WorldState scaled(const belief::WorldState& state, const Similarity& similarity) {
  belief::WorldState result = state;
  result.time *= similarity.time();
  for (belief::ObjectState& object : result.objects) {
    object.X_WO.translation *= similarity.length;
    object.V_WO.angular /= similarity.time();
    object.V_WO.linear *= similarity.length / similarity.time();
    object.physical.center_of_mass *= similarity.length;
  }
  for (belief::JointParameters& joint : result.joints) {
    const JointScale factors = scale_of(joint.type, similarity);
    joint.friction *= factors.friction;
    joint.damping *= factors.damping;
  }
  return result;
}

void scale(const Similarity& similarity, belief::Trajectory& trajectory) {
  for (belief::WorldState& state : trajectory.states) state = scaled(state, similarity);
  for (belief::ContactInterval& contact : trajectory.contacts) {
    contact.begin *= similarity.time();
    contact.end *= similarity.time();
    contact.largest_impulse *= similarity.length / similarity.time();
  }
  trajectory.simulated_seconds *= similarity.time();
  trajectory.flown_seconds *= similarity.time();
  trajectory.deepest_overlap *= similarity.length;
}

}  // namespace prescene::simulation
