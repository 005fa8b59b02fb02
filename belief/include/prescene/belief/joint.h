// SPDX-License-Identifier: Apache-2.0
// Joints: what holds an object to another thing so that one freedom is left. A drawer is a box on a slider in a fixed
// cabinet, a lid is an object on a hinge.
//
//   Joint slide{"slide", JointType::kSlider, "cabinet", "drawer"};
//   slide.axis_P = Vector3d::UnitX();
//   slide.X_PC0 = Pose::from_translation({0.0, 0.0, 0.2});  // of the drawer in the cabinet, shut
//   slide.low = 0.0;
//   slide.high = 0.3;
//   const JointState state = joint_state(slide, X_WP, Twist{}, X_WC, V_WC);  // how far it is open, and how fast
//
// A parent P is an object, a support or the world; the child C is an object. Every object is the child of at most one
// joint, so the joints of a scene make trees: closed loops are refused by validate(Scene).
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/distribution.h"
#include "prescene/core/status.h"

namespace prescene::belief {

struct Scene;
struct WorldState;
struct Belief;

enum class JointType {
  kHinge,   ///< Turns about an axis (revolute); positions in rad.
  kSlider,  ///< Moves along an axis (prismatic); positions in m.
};
/// "hinge", "slider".
std::string to_string(JointType type);
/// "rad", "m".
std::string unit_of(JointType type);

struct Joint {
  std::string name;  ///< Unique among the joints.
  JointType type = JointType::kHinge;
  std::string parent;                    ///< An object or support; "" = the world.
  std::string child;                     ///< An object.
  Vector3d axis_P = Vector3d::UnitZ();   ///< Unit vector in P; positive positions turn or move the child by it.
  Vector3d anchor_P = Vector3d::Zero();  ///< A point of the axis, m; of a slider, where errors are measured.
  Pose X_PC0 = {};                       ///< The child in P at position 0.
  double low = -std::numeric_limits<double>::infinity();  ///< Least position; the ends are hard stops without bounce.
  double high = std::numeric_limits<double>::infinity();
  /// Coulomb friction, N m or N, the same at rest and in motion; >= 0.
  ScalarDistribution friction = FixedScalar{0.0};
  /// Viscous damping, N m s/rad or N s/m; >= 0.
  ScalarDistribution damping = FixedScalar{0.0};

  friend bool operator==(const Joint&, const Joint&) = default;
};

/// What is drawn of a joint for one instance; units as in Joint.
struct JointParameters {
  JointType type = JointType::kHinge;
  double friction = 0.0;
  double damping = 0.0;
  friend bool operator==(const JointParameters&, const JointParameters&) = default;
};

struct JointState {
  double position = 0.0;  ///< rad or m; of hinges within half a turn of the middle between the limits.
  double velocity = 0.0;  ///< rad/s or m/s
  friend bool operator==(const JointState&, const JointState&) = default;
};

/// How far a child is from where its joint allows it to be, limits apart.
struct JointError {
  double distance = 0.0;  ///< m, >= 0
  double angle = 0.0;     ///< rad, >= 0
};

/// A joint's position as the belief has it.
struct JointEstimate {
  std::string joint;
  JointType type = JointType::kHinge;
  double position = 0.0;            ///< rad or m
  double standard_deviation = 0.0;  ///< Of the position.
  double velocity = 0.0;            ///< rad/s or m/s
  double low = 0.0, high = 0.0;     ///< The joint's limits; infinite where there is none.
  /// Probability that both things are where the belief says: the product of their confidences.
  double confidence = 0.0;
  friend bool operator==(const JointEstimate&, const JointEstimate&) = default;
};

/// Where a joint is at the end, over all instances.
struct JointForecast {
  std::string joint;
  JointType type = JointType::kHinge;
  double mean = 0.0;                           ///< rad or m
  double standard_deviation = 0.0;             ///< Over the instances.
  double low = 0.0, middle = 0.0, high = 0.0;  ///< Its 5 %, 50 % and 95 % quantiles.
  friend bool operator==(const JointForecast&, const JointForecast&) = default;
};

/// Of the world itself as a parent, in files and messages.
inline constexpr const char* kWorldName = "world";
/// A start that is off its joint by more than this is an error.
inline constexpr double kJointDistanceTolerance = 2e-3;  ///< m
inline constexpr double kJointAngleTolerance = 0.0175;   ///< rad: one degree

/// Of the child at a position.
Pose child_pose(const Joint& joint, const Pose& X_WP, double position);
/// The twist of the child's origin in W when it moves as the joint allows.
Twist child_twist(const Joint& joint, const Pose& X_WP, const Twist& V_WP, const JointState& state);
/// The nearest that the joint allows, limits apart.
JointState joint_state(const Joint& joint, const Pose& X_WP, const Twist& V_WP, const Pose& X_WC, const Twist& V_WC);
JointError joint_error(const Joint& joint, const Pose& X_WP, const Pose& X_WC);

std::optional<int> find_joint(const Scene& scene, const std::string& name);
/// The joint of which the object is the child.
std::optional<int> joint_of(const Scene& scene, const std::string& child);
/// Whether a joint joins these two directly: then they don't touch each other.
bool are_jointed(const Scene& scene, const std::string& a, const std::string& b);
/// Indices of the joints so that a joint whose parent hangs on another comes after that one.
std::vector<int> joint_order(const Scene& scene);
/// Of the scene's joints in a world state.
std::vector<JointState> joint_states(const Scene& scene, const WorldState& state);
/// Moves children to where their joints, limits included, allow them to be, parents first, and takes away the
/// velocities that they forbid. What is right already within rounding is left as it is.
void obey_joints(const Scene& scene, WorldState& state);
/// Those of the state or, where it has none, the means.
JointParameters parameters_of(const Scene& scene, const WorldState& state, int joint);
/// Removes the joints of objects that the scene does not have (any more), and returns their names.
std::vector<std::string> drop_loose_joints(Scene& scene);

/// Of the joints whose things the belief has, in the scene's order.
std::vector<JointEstimate> joint_estimates(const Belief& belief);
/// Before anything is seen: as the starts of the scene's objects are given.
std::vector<JointEstimate> joint_estimates(const Scene& scene);

/// Names, an axis of length 1, limits in order, ranges of friction and damping, parents and children that are there, no
/// loops: the message names the joint.
core::Status validate_joints(const Scene& scene);

}  // namespace prescene::belief
