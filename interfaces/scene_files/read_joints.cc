// SPDX-License-Identifier: Apache-2.0
// The section `joints`, and how the starts of jointed objects fit their joints.
#include <algorithm>
#include <cmath>

#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"
#include "prescene/interfaces/bytes/text.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using belief::Joint;
using belief::JointType;
using belief::Scene;
using geometry::Pose;
using geometry::Vector3d;

constexpr NumberRange kJointAngle{-350.0, 350.0, "give degrees between -350 and 350", "deg"};
constexpr NumberRange kJointTravel{-100.0, 100.0, "give metres between -100 and 100", "m"};
constexpr NumberRange kJointFriction{0.0, 1e6, "give N m for a hinge, N for a slider, at least 0"};
constexpr NumberRange kJointDamping{0.0, 1e6, "give N m s/rad for a hinge, N s/m for a slider, at least 0"};
constexpr double kWidestHingeDeg = 350.0;

bool is_hinge(const Joint& joint) { return joint.type == JointType::kHinge; }
double in_file(const Joint& joint, double position) {
  return is_hinge(joint) ? position * geometry::kDegreesPerRadian : position;
}
std::string position_text(const Joint& joint, double position) {
  return core::rounded_text(in_file(joint, position)) + (is_hinge(joint) ? " degrees" : " m");
}

/// At the objects' mean starts.
Pose mean_pose_of(const Scene& scene, const std::string& name) {
  if (const auto object = belief::find_object(scene, name))
    return belief::mean(scene.objects[static_cast<std::size_t>(*object)].pose);
  if (const auto support = belief::find_support(scene, name))
    return scene.supports[static_cast<std::size_t>(*support)].X_WS;
  return {};
}

class JointReader {
 public:
  JointReader(const LocatedValue& value, const std::string& name, SceneContext& context)
      : context_(context), problems_(context.problems), value_(value), binder_(value, context.problems) {
    joint_.name = name;
  }

  Joint read() {
    const std::size_t before = problems_.errors().size();
    binder_.require("type", "give 'hinge' or 'slider'");
    binder_.read_enum<JointType>("type", joint_.type, {{"hinge", JointType::kHinge}, {"slider", JointType::kSlider}});
    if (const LocatedValue* at = binder_.require("child", "name the object that the joint lets move"))
      joint_.child = read_child(*at);
    if (const LocatedValue* at = binder_.require("parent", "name an object, a support or 'world'"))
      joint_.parent = read_parent(*at);
    if (const LocatedValue* at = binder_.require("axis", "give x, -x, y, ... or a vector in the parent's frame"))
      joint_.axis_P = read_axis(*at, problems_);
    const char* anchor_remedy = "give a point [x, y, z] of the axis in the parent's frame, m";
    if (const LocatedValue* at = is_hinge(joint_) ? binder_.require("anchor", anchor_remedy) : binder_.find("anchor"))
      joint_.anchor_P = read_vector(*at, problems_, kPosition);
    read_limits();
    read_resistance("friction", kJointFriction, joint_.friction);
    read_resistance("damping", kJointDamping, joint_.damping);
    read_place(problems_.errors().size() == before);
    return joint_;
  }

 private:
  std::string read_child(const LocatedValue& at) {
    const bool fixed = has(context_.supports, at.text) && !has(context_.objects, at.text);
    if (fixed || (at.text == belief::kWorldName && !has(context_.objects, at.text))) {
      problems_.add(at.place, at.path, interfaces::quote(at.text) + " is fixed, and a joint's child moves",
                    "make it the parent, or an object");
      return {};
    }
    std::string child = context_.read_name(at, context_.objects, "an object");
    if (child.empty()) return child;
    for (const Joint& other : context_.scene.joints) {
      if (other.child != child) continue;
      problems_.add(at.place, at.path,
                    interfaces::quote(child) + " is the child of the joint " + interfaces::quote(other.name) + ", too",
                    "leave one of the two out: joints that close a loop are not simulated");
    }
    const belief::SceneObject& object =
        context_.scene.objects[static_cast<std::size_t>(*belief::find_object(context_.scene, child))];
    if (object.held_by)
      problems_.add(at.place, at.path, interfaces::quote(child) + " is held, and a joint's child can't be",
                    "take its 'held_by' out, and let a robot body push or pull it");
    return child;
  }

  std::string read_parent(const LocatedValue& at) {
    if (has(context_.robot, at.text)) {
      problems_.add(at.place, at.path, interfaces::quote(at.text) + " is a robot body, and nothing hangs on these",
                    "name an object, a support or 'world'");
      return {};
    }
    std::vector<std::string> names = context_.objects;
    names.insert(names.end(), context_.supports.begin(), context_.supports.end());
    if (at.text == belief::kWorldName && !has(names, at.text)) return {};
    names.emplace_back(belief::kWorldName);
    std::string parent = context_.read_name(at, names, "an object, a support or 'world'");
    if (!parent.empty() && parent == joint_.child)
      problems_.add(at.place, at.path, "the parent and the child are the same", "name what the child moves against");
    return parent;
  }

  static bool has(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  }

  void read_limits() {
    const bool hinge = is_hinge(joint_);
    const NumberRange& range = hinge ? kJointAngle : kJointTravel;
    const double unit = hinge ? geometry::kDegree : 1.0;
    const char* low_key = hinge ? "min_deg" : "min";
    const char* high_key = hinge ? "max_deg" : "max";
    if (binder_.read(low_key, joint_.low, range)) joint_.low *= unit;
    if (binder_.read(high_key, joint_.high, range)) joint_.high *= unit;
    const LocatedValue* low = value_.find(low_key);
    const LocatedValue* high = value_.find(high_key);
    if (joint_.low > joint_.high) {
      problems_.add(
          high->place, high->path,
          position_text(joint_, joint_.high) + " is below " + low_key + ", " + position_text(joint_, joint_.low),
          "exchange them");
    } else if (hinge && (low || high) && !(in_file(joint_, joint_.high - joint_.low) <= kWidestHingeDeg)) {
      problems_.add((low ? low : high)->place, (low ? low : high)->path,
                    low && high ? "the limits are more than 350 degrees apart" : "a hinge has both limits or none",
                    "give min_deg and max_deg at most 350 apart, or none of them");
    }
  }

  void read_resistance(const char* key, const NumberRange& range, belief::ScalarDistribution& to) {
    if (const LocatedValue* at = binder_.find(key)) to = read_scalar(*at, problems_, range, true);
  }

  /// Where the child is at position 0: said, or as the starts are.
  void read_place(bool readable) {
    const bool hinge = is_hinge(joint_);
    const char* start_key = hinge ? "start_deg" : "start";
    double start = 0.0;
    const LocatedValue* zero = binder_.find("child_pose");
    const bool has_start = binder_.read(start_key, start, hinge ? kJointAngle : kJointTravel);
    if (zero) joint_.X_PC0 = read_pose(*zero, problems_);
    if (zero && has_start) {
      const LocatedValue& at = *value_.find(start_key);
      problems_.add(at.place, at.path, "where the joint starts follows from 'child_pose' and the objects' poses",
                    "give one of the two");
      return;
    }
    if (hinge && has_start && std::isinf(joint_.low) && std::abs(start) > 180.0) {
      const LocatedValue& at = *value_.find(start_key);
      problems_.add(at.place, at.path, "the position of a hinge without limits is between -180 and 180 degrees",
                    "give " + core::rounded_text(std::remainder(start, 360.0)) + ", or min_deg and max_deg");
      return;
    }
    if (zero || !readable) return;
    const double position = hinge ? geometry::kDegree * start : start;
    const Pose X_PC =
        mean_pose_of(context_.scene, joint_.parent).inverse() * mean_pose_of(context_.scene, joint_.child);
    // What turns or moves the child back to 0.
    Joint back = joint_;
    back.X_PC0 = X_PC;
    joint_.X_PC0 = geometry::normalized(belief::child_pose(back, Pose{}, -position));
  }

  SceneContext& context_;
  Problems& problems_;
  const LocatedValue& value_;
  Binder binder_;
  Joint joint_;
};

const LocatedValue& pose_at_of(const LocatedValue& document, const Joint& joint) {
  const LocatedValue& child = *document.find("objects")->find(joint.child);
  const LocatedValue* pose = child.find("pose");
  return pose ? *pose : child;
}

std::string away_text(const belief::JointError& error) {
  return core::rounded_text(1e3 * error.distance) + " mm and " +
         core::rounded_text(error.angle * geometry::kDegreesPerRadian) + " degrees";
}

bool is_off(const belief::JointError& error) {
  return error.distance > belief::kJointDistanceTolerance || error.angle > belief::kJointAngleTolerance;
}

/// Which of the two is wrong, the child's start or the joint, the file does not say: both places are named.
void check_start(const LocatedValue& at, const LocatedValue& pose, const Joint& joint, const Pose& X_WP,
                 const Pose& X_WC, Problems& problems) {
  const belief::JointError error = belief::joint_error(joint, X_WP, X_WC);
  const double position = belief::joint_state(joint, X_WP, {}, X_WC, {}).position;
  if (is_off(error)) {
    const Pose nearest = belief::child_pose(joint, X_WP, std::clamp(position, joint.low, joint.high));
    const Vector3d& p = nearest.translation;
    problems.add(pose.place, pose.path,
                 "it starts " + away_text(error) + " away from where the joint " + interfaces::quote(joint.name) +
                     " allows it to be",
                 "move it to [" + core::rounded_text(p.x()) + ", " + core::rounded_text(p.y()) + ", " +
                     core::rounded_text(p.z()) + "] or its like, or correct 'child_pose', 'axis' or 'anchor'");
    problems.add(at.place, at.path,
                 "its child " + interfaces::quote(joint.child) + " starts " + away_text(error) +
                     " away from where it allows it to be",
                 "correct 'child_pose', 'axis' or 'anchor', or move the child's start");
    return;
  }
  const double tolerance = is_hinge(joint) ? belief::kJointAngleTolerance : belief::kJointDistanceTolerance;
  if (position >= joint.low - tolerance && position <= joint.high + tolerance) return;
  const std::string beyond = position_text(joint, position) + ", beyond its limit of " +
                             position_text(joint, std::clamp(position, joint.low, joint.high));
  problems.add(at.place, at.path, "the joint starts at " + beyond, "widen the limits, or move the child's start");
  problems.add(pose.place, pose.path, "the joint " + interfaces::quote(joint.name) + " starts at " + beyond,
               "move the start, or widen the joint's limits");
}

/// Draws of the start that the joint does not allow are moved to where it does, which whoever wrote them may not mean.
void warn_of_spread(const LocatedValue& pose, const Joint& joint, const belief::PoseDistribution& distribution,
                    const Pose& X_WP, Problems& problems) {
  const int count = belief::dimensions(distribution);
  for (int k = 0; k < count; ++k) {
    for (const double end : {0.16, 0.84}) {
      std::vector<double> uniforms(static_cast<std::size_t>(count), 0.5);
      uniforms[static_cast<std::size_t>(k)] = end;
      const belief::JointError error = belief::joint_error(joint, X_WP, belief::draw(distribution, uniforms));
      if (!is_off(error)) continue;
      problems.warn(pose.place, pose.path,
                    "its start spreads by " + away_text(error) + " across what the joint " +
                        interfaces::quote(joint.name) + " leaves free",
                    "only what moves the joint counts: spread the pose along that, and the parent's for the rest");
      return;
    }
  }
}

}  // namespace

belief::Joint read_joint(const LocatedValue& value, const std::string& name, SceneContext& context) {
  return JointReader(value, name, context).read();
}

void refuse_starts_off_joints(const LocatedValue& document, const Scene& scene, Problems& problems) {
  for (const Joint& joint : scene.joints) {
    const LocatedValue& at = *document.find("joints")->find(joint.name);
    const LocatedValue& pose = pose_at_of(document, joint);
    const belief::SceneObject& child =
        scene.objects[static_cast<std::size_t>(*belief::find_object(scene, joint.child))];
    const Pose X_WP = mean_pose_of(scene, joint.parent);
    const std::size_t before = problems.errors().size();
    check_start(at, pose, joint, X_WP, belief::mean(child.pose), problems);
    if (problems.errors().size() == before) warn_of_spread(pose, joint, child.pose, X_WP, problems);
  }
}

}  // namespace prescene::interfaces
