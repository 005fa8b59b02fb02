// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/joint.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string_view>

#include "prescene/belief/scene.h"
#include "prescene/belief/validation.h"

namespace prescene::belief {
namespace {

using core::invalid_input;
using core::not_found;
using core::Status;

// m and rad: a start that is off by less obeys its joint.
constexpr double kJointRounding = 1e-9;
constexpr ScalarRange kJointFrictionRange{0.0, 1e6, "give N m of a hinge or N of a slider, at least 0", true};
constexpr ScalarRange kJointDampingRange{0.0, 1e6, "give N m s/rad of a hinge or N s/m of a slider, at least 0", true};
// Of a hinge, so that positions are distinguished where it turns all the way round.
constexpr double kWidestHinge = 350.0 / 180.0 * std::numbers::pi;

/// The point of the child that is on the anchor at position 0, in C.
Vector3d anchor_in_child(const Joint& joint) { return joint.X_PC0.inverse() * joint.anchor_P; }

/// Within half a turn of the middle of the limits.
double unwrapped(const Joint& joint, double angle) {
  const bool limited = std::isfinite(joint.low) && std::isfinite(joint.high);
  const double middle = limited ? 0.5 * (joint.low + joint.high) : 0.0;
  return angle - 2.0 * std::numbers::pi * std::round((angle - middle) / (2.0 * std::numbers::pi));
}

double position_of(const Joint& joint, const Pose& X_PC) {
  if (joint.type == JointType::kSlider) return joint.axis_P.dot(X_PC * anchor_in_child(joint) - joint.anchor_P);
  const geometry::Quaterniond turn = X_PC.rotation * joint.X_PC0.rotation.conjugate();
  return unwrapped(joint, 2.0 * std::atan2(turn.vec().dot(joint.axis_P), turn.w()));
}

struct Parent {
  Pose X_WP;
  Twist V_WP;
};
Parent parent_of(const Scene& scene, const Joint& joint, const WorldState& state) {
  if (const auto object = find_object(scene, joint.parent)) {
    const ObjectState& parent = state.objects[static_cast<std::size_t>(*object)];
    return {parent.X_WO, parent.V_WO};
  }
  if (const auto support = find_support(scene, joint.parent))
    return {scene.supports[static_cast<std::size_t>(*support)].X_WS, Twist{}};
  return {};
}

Status check_limits(const Joint& joint) {
  if (std::isnan(joint.low) || std::isnan(joint.high)) return invalid_input("a limit is not a number");
  if (joint.low > joint.high) return invalid_input("its least position is above its greatest: exchange the limits");
  const bool limited = std::isfinite(joint.low) || std::isfinite(joint.high);
  if (joint.type == JointType::kHinge && limited && !(joint.high - joint.low <= kWidestHinge))
    return invalid_input(
        "the limits of a hinge are more than 350 degrees apart: give both, nearer to each other, or none");
  return {};
}

Status check_joint(const Scene& scene, const Joint& joint) {
  PRESCENE_RETURN_IF_ERROR(check_name(joint.name));
  if (!find_object(scene, joint.child))
    return not_found("its child '" + joint.child + "' is not an object: only objects move, name one of the scene's");
  if (!joint.parent.empty() && !find_object(scene, joint.parent) && !find_support(scene, joint.parent))
    return not_found("its parent '" + joint.parent + "' is neither an object nor a support: name one, or the world");
  if (joint.parent == joint.child) return invalid_input("its parent and child are the same: name another parent");
  if (!joint.axis_P.allFinite() || std::abs(joint.axis_P.norm() - 1.0) > 1e-6)
    return invalid_input("its axis is not of length 1: normalise it");
  if (!joint.anchor_P.allFinite() || joint.anchor_P.cwiseAbs().maxCoeff() > kLengthRange.high)
    return invalid_input(std::string("its anchor is out of range: ") + kLengthRange.remedy);
  PRESCENE_RETURN_IF_ERROR(check_pose(joint.X_PC0).at("the child's pose at position 0"));
  PRESCENE_RETURN_IF_ERROR(check_limits(joint));
  PRESCENE_RETURN_IF_ERROR(check_scalar(joint.friction, kJointFrictionRange).at("friction"));
  return check_scalar(joint.damping, kJointDampingRange).at("damping");
}

}  // namespace

std::string to_string(JointType type) { return type == JointType::kHinge ? "hinge" : "slider"; }
std::string unit_of(JointType type) { return type == JointType::kHinge ? "rad" : "m"; }

Pose child_pose(const Joint& joint, const Pose& X_WP, double position) {
  if (joint.type == JointType::kSlider) return X_WP * (Pose::from_translation(position * joint.axis_P) * joint.X_PC0);
  const geometry::Quaterniond turn = geometry::exp_rotation(position * joint.axis_P);
  return X_WP * (Pose{turn, joint.anchor_P - turn * joint.anchor_P} * joint.X_PC0);
}

Twist child_twist(const Joint& joint, const Pose& X_WP, const Twist& V_WP, const JointState& state) {
  const Vector3d p_WC = child_pose(joint, X_WP, state.position).translation;
  const Vector3d rate_W = X_WP.rotation * (state.velocity * joint.axis_P);
  Twist V_WC = geometry::shifted(V_WP, p_WC - X_WP.translation);
  if (joint.type == JointType::kSlider) {
    V_WC.linear += rate_W;
  } else {
    V_WC.angular += rate_W;
    V_WC.linear += rate_W.cross(p_WC - X_WP * joint.anchor_P);
  }
  return V_WC;
}

JointState joint_state(const Joint& joint, const Pose& X_WP, const Twist& V_WP, const Pose& X_WC, const Twist& V_WC) {
  JointState state;
  state.position = position_of(joint, X_WP.inverse() * X_WC);
  const Vector3d axis_W = X_WP.rotation * joint.axis_P;
  if (joint.type == JointType::kHinge) {
    state.velocity = axis_W.dot(V_WC.angular - V_WP.angular);
  } else {
    const Vector3d p_WQ = X_WC * anchor_in_child(joint);
    state.velocity = axis_W.dot(geometry::shifted(V_WC, p_WQ - X_WC.translation).linear -
                                geometry::shifted(V_WP, p_WQ - X_WP.translation).linear);
  }
  return state;
}

JointError joint_error(const Joint& joint, const Pose& X_WP, const Pose& X_WC) {
  const Pose X_PC = X_WP.inverse() * X_WC;
  const Pose nearest = child_pose(joint, Pose{}, position_of(joint, X_PC));
  const Vector3d anchor_C = anchor_in_child(joint);
  return {(X_PC * anchor_C - nearest * anchor_C).norm(), geometry::angle_between(X_PC.rotation, nearest.rotation)};
}

std::optional<int> find_joint(const Scene& scene, const std::string& name) {
  for (std::size_t j = 0; j < scene.joints.size(); ++j)
    if (scene.joints[j].name == name) return static_cast<int>(j);
  return std::nullopt;
}

std::optional<int> joint_of(const Scene& scene, const std::string& child) {
  for (std::size_t j = 0; j < scene.joints.size(); ++j)
    if (scene.joints[j].child == child) return static_cast<int>(j);
  return std::nullopt;
}

bool are_jointed(const Scene& scene, const std::string& a, const std::string& b) {
  return std::any_of(scene.joints.begin(), scene.joints.end(), [&](const Joint& joint) {
    return (joint.child == a && joint.parent == b) || (joint.child == b && joint.parent == a);
  });
}

std::vector<int> joint_order(const Scene& scene) {
  const std::size_t count = scene.joints.size();
  std::map<std::string_view, std::size_t> joint_of_child;
  for (std::size_t j = 0; j < count; ++j) joint_of_child.try_emplace(scene.joints[j].child, j);
  // In which of several passes through the joints, each of which takes those whose parents are placed.
  constexpr int kUnknown = -1, kOpen = -2, kInLoop = -3;
  std::vector<int> passes(count, kUnknown);
  std::vector<std::size_t> chain;  // from a joint up to the first whose pass is known
  for (std::size_t j = 0; j < count; ++j) {
    std::optional<std::size_t> before = j;
    for (chain.clear(); before && passes[*before] == kUnknown;) {
      passes[*before] = kOpen;
      chain.push_back(*before);
      const auto found = joint_of_child.find(scene.joints[*before].parent);
      before = found == joint_of_child.end() ? std::nullopt : std::optional<std::size_t>(found->second);
    }
    const bool loops = before && (passes[*before] == kOpen || passes[*before] == kInLoop);
    for (auto joint = chain.rbegin(); joint != chain.rend(); before = *joint++)
      passes[*joint] = loops ? kInLoop : before ? passes[*before] + (*before > *joint ? 1 : 0) : 0;
  }
  std::vector<int> order;
  for (std::size_t j = 0; j < count; ++j)
    if (passes[j] >= 0) order.push_back(static_cast<int>(j));
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return passes[static_cast<std::size_t>(a)] < passes[static_cast<std::size_t>(b)];
  });
  return order;
}

std::vector<JointState> joint_states(const Scene& scene, const WorldState& state) {
  std::vector<JointState> states;
  for (const Joint& joint : scene.joints) {
    const Parent parent = parent_of(scene, joint, state);
    const ObjectState& child = state.objects[static_cast<std::size_t>(*find_object(scene, joint.child))];
    states.push_back(joint_state(joint, parent.X_WP, parent.V_WP, child.X_WO, child.V_WO));
  }
  return states;
}

void obey_joints(const Scene& scene, WorldState& state) {
  for (const int j : joint_order(scene)) {
    const Joint& joint = scene.joints[static_cast<std::size_t>(j)];
    ObjectState& child = state.objects[static_cast<std::size_t>(*find_object(scene, joint.child))];
    if (child.mode == MotionMode::kHeld) continue;
    const Parent parent = parent_of(scene, joint, state);
    JointState at = joint_state(joint, parent.X_WP, parent.V_WP, child.X_WO, child.V_WO);
    const JointError error = joint_error(joint, parent.X_WP, child.X_WO);
    const double allowed = std::clamp(at.position, joint.low, joint.high);
    if (std::max({error.distance, error.angle, std::abs(allowed - at.position)}) > kJointRounding) {
      at.position = allowed;
      child.X_WO = geometry::normalized(child_pose(joint, parent.X_WP, at.position));
    }
    const Twist V_WC = child_twist(joint, parent.X_WP, parent.V_WP, at);
    if ((V_WC.angular - child.V_WO.angular).norm() + (V_WC.linear - child.V_WO.linear).norm() > kJointRounding)
      child.V_WO = V_WC;
  }
}

JointParameters parameters_of(const Scene& scene, const WorldState& state, int joint) {
  const auto j = static_cast<std::size_t>(joint);
  if (j < state.joints.size()) return state.joints[j];
  return {scene.joints[j].type, mean(scene.joints[j].friction), mean(scene.joints[j].damping)};
}

std::vector<std::string> drop_loose_joints(Scene& scene) {
  std::vector<std::string> dropped;
  const auto loose = [&](const Joint& joint) {
    const bool has_parent =
        joint.parent.empty() || find_object(scene, joint.parent) || find_support(scene, joint.parent);
    if (has_parent && find_object(scene, joint.child)) return false;
    dropped.push_back(joint.name);
    return true;
  };
  std::erase_if(scene.joints, loose);
  return dropped;
}

Status validate_joints(const Scene& scene) {
  std::set<std::string> names, children;
  for (const Joint& joint : scene.joints) {
    const std::string place = "joint '" + joint.name + "'";
    PRESCENE_RETURN_IF_ERROR(check_joint(scene, joint).at(place));
    if (!names.insert(joint.name).second) return invalid_input("two joints have this name: rename one").at(place);
    if (!children.insert(joint.child).second)
      return invalid_input("'" + joint.child + "' is the child of another joint, too: of a closed loop leave one out")
          .at(place);
    const SceneObject& child = scene.objects[static_cast<std::size_t>(*find_object(scene, joint.child))];
    if (child.held_by)
      return invalid_input("its child '" + joint.child + "' is held: hold what it hangs on, or push it").at(place);
  }
  if (joint_order(scene).size() != scene.joints.size())
    return invalid_input("the joints make a loop in which each thing hangs on the next: leave one of them out");
  return {};
}

}  // namespace prescene::belief
