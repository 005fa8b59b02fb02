// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/ros_messages/conversions.h"

#include <cmath>
#include <set>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/utf8.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/interfaces/bytes/text.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using geometry::Matrix3d;
using geometry::Matrix6d;
using geometry::Pose;
using geometry::Quaterniond;
using geometry::Vector3d;

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr std::size_t kMaxFrameIdBytes = 255;
// A quaternion that is off by rounding is normalised; one that is far off is something else (Euler angles, a wrong
// field).
constexpr double kMaxNormError = 0.1;

std::string vector_text(const Vector3d& v) {
  return "(" + number_text(v.x()) + ", " + number_text(v.y()) + ", " + number_text(v.z()) + ")";
}

Result<Vector3d> to_position(const Vector3d& p, const char* field, const PoseRules& rules) {
  if (!p.allFinite()) {
    return core::invalid_input(std::string(field) + ": " + vector_text(p) +
                               " is not finite; send nothing when there is no estimate");
  }
  if (p.cwiseAbs().maxCoeff() > rules.max_coordinate) {
    return core::invalid_input(std::string(field) + ": " + vector_text(p) + " is more than " +
                               number_text(rules.max_coordinate) + " m away; send metres");
  }
  return p;
}

Result<Pose> make_pose(const Vector3d& p, const char* position_field, const RosQuaternion& q,
                       const char* rotation_field, const PoseRules& rules) {
  PRESCENE_TRY(const Vector3d translation, to_position(p, position_field, rules));
  const Result<Quaterniond> rotation = to_rotation(q, rules);
  if (!rotation) return rotation.status().at(rotation_field);
  return Pose{*rotation, translation};
}

RosQuaternion to_ros_quaternion(const Quaterniond& q) { return {q.x(), q.y(), q.z(), q.w()}; }

Matrix6d ros_from_error_coordinates(const Matrix3d& R) {
  Matrix6d J = Matrix6d::Zero();
  J.topRightCorner<3, 3>() = Matrix3d::Identity();
  J.bottomLeftCorner<3, 3>() = R;
  return J;
}

bool has_control_bytes(std::string_view text) {
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return true;
  }
  return false;
}

Result<FrameTransform> to_transform(const RosTransformStamped& message, const PoseRules& rules) {
  FrameTransform transform;
  const Result<std::string> parent = to_frame_id(message.header.frame_id);
  if (!parent) return parent.status().at("header.frame_id");
  const Result<std::string> child = to_frame_id(message.child_frame_id);
  if (!child) return child.status().at("child_frame_id");
  if (*parent == *child) {
    return core::invalid_input("frame " + quote(*child) + " is its own parent; name two different frames");
  }
  const Result<std::int64_t> stamp_ns = to_stamp_ns(message.header.stamp);
  if (!stamp_ns) return stamp_ns.status().at("header.stamp");
  const Result<Pose> pose = to_pose(message.transform, rules);
  if (!pose) return pose.status().at(quote(*parent) + " to " + quote(*child));
  return FrameTransform{*parent, *child, *stamp_ns, *pose};
}

}  // namespace

Result<std::int64_t> to_stamp_ns(const RosTime& stamp) {
  if (stamp.nanosec >= kNanosecondsPerSecond) {
    return core::invalid_input("nanosec is " + std::to_string(stamp.nanosec) +
                               "; it must be below 1000000000, the rest belongs in sec");
  }
  if (stamp.sec < 0) return core::invalid_input("sec is " + std::to_string(stamp.sec) + "; times begin with 1970");
  return stamp.sec * kNanosecondsPerSecond + stamp.nanosec;
}

RosTime to_ros_time(std::int64_t stamp_ns) {
  const std::int64_t seconds = stamp_ns / kNanosecondsPerSecond;
  PRESCENE_CHECK(stamp_ns >= 0 && seconds <= 0x7fffffff);
  return {static_cast<std::int32_t>(seconds), static_cast<std::uint32_t>(stamp_ns % kNanosecondsPerSecond)};
}

Result<std::string> to_frame_id(std::string_view frame_id) {
  std::string_view name = frame_id;
  if (name.starts_with('/')) name.remove_prefix(1);
  if (name.empty()) return core::invalid_input("the frame id is empty; name the frame that the data are measured in");
  if (name.size() > kMaxFrameIdBytes) {
    return core::invalid_input("the frame id " + quote(name, 24) + " has " + std::to_string(name.size()) +
                               " bytes; use at most " + std::to_string(kMaxFrameIdBytes));
  }
  if (!core::is_utf8(name)) {
    return core::invalid_input("the frame id " + quote(name) + " is not UTF-8; use letters, digits, _ and /");
  }
  if (has_control_bytes(name)) {
    return core::invalid_input("the frame id " + quote(name) + " has control bytes; use letters, digits, _ and /");
  }
  return std::string(name);
}

Result<Quaterniond> to_rotation(const RosQuaternion& q, const PoseRules& rules) {
  const std::string text = "(x " + number_text(q.x) + ", y " + number_text(q.y) + ", z " + number_text(q.z) + ", w " +
                           number_text(q.w) + ")";
  const Quaterniond raw(q.w, q.x, q.y, q.z);
  if (!raw.coeffs().allFinite()) {
    return core::invalid_input("the quaternion " + text + " is not finite; send nothing when there is no estimate");
  }
  if (raw.coeffs().isZero(0.0)) {
    if (rules.zero_quaternion_is_identity) return Quaterniond::Identity();
    return core::invalid_input("the quaternion is all zero; set w = 1 for no rotation");
  }
  const double norm = raw.norm();
  if (!(std::abs(norm - 1.0) <= kMaxNormError)) {
    return core::invalid_input("the quaternion " + text + " has the norm " + number_text(norm) +
                               "; normalise it before sending");
  }
  Pose X{raw, Vector3d::Zero()};
  return geometry::normalized(X).rotation;
}

Result<Pose> to_pose(const RosPose& pose, const PoseRules& rules) {
  return make_pose({pose.position.x, pose.position.y, pose.position.z}, "position", pose.orientation, "orientation",
                   rules);
}

Result<Pose> to_pose(const RosTransform& transform, const PoseRules& rules) {
  return make_pose({transform.translation.x, transform.translation.y, transform.translation.z}, "translation",
                   transform.rotation, "rotation", rules);
}

Result<geometry::Twist> to_twist(const RosTwist& twist) {
  const geometry::Twist V{{twist.angular.x, twist.angular.y, twist.angular.z},
                          {twist.linear.x, twist.linear.y, twist.linear.z}};
  if (!V.is_finite()) {
    return core::invalid_input("the twist with linear " + vector_text(V.linear) + " and angular " +
                               vector_text(V.angular) + " is not finite; send nothing when there is no estimate");
  }
  return V;
}

Result<std::optional<Matrix6d>> to_covariance(const RosPoseWithCovariance& pose) {
  const Matrix6d raw = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(pose.covariance.data());
  if (raw.isZero(0.0) || raw(0, 0) == -1.0) return std::optional<Matrix6d>();
  const Result<Quaterniond> rotation = to_rotation(pose.pose.orientation);
  if (!rotation) return rotation.status().at("pose.orientation");
  const Matrix6d inverse = ros_from_error_coordinates(rotation->toRotationMatrix()).transpose();
  Matrix6d covariance = inverse * (0.5 * (raw + raw.transpose())) * inverse.transpose();
  if (!covariance.allFinite()) {
    return core::invalid_input("covariance: has entries that are not finite; send all zeros when it is unknown");
  }
  const geometry::SymmetricEigen6 eigen = geometry::symmetric_eigen_6(covariance);
  if (eigen.values.minCoeff() < 0.0) {
    const Matrix6d& V = eigen.vectors;
    covariance = V * eigen.values.cwiseMax(0.0).asDiagonal() * V.transpose();
    covariance = (0.5 * (covariance + covariance.transpose())).eval();
  }
  return std::optional<Matrix6d>(covariance);
}

RosPose to_ros_pose(const Pose& X) {
  return {{X.translation.x(), X.translation.y(), X.translation.z()}, to_ros_quaternion(X.rotation)};
}

RosTransform to_ros_transform(const Pose& X) {
  return {{X.translation.x(), X.translation.y(), X.translation.z()}, to_ros_quaternion(X.rotation)};
}

RosTwist to_ros_twist(const geometry::Twist& V) {
  return {{V.linear.x(), V.linear.y(), V.linear.z()}, {V.angular.x(), V.angular.y(), V.angular.z()}};
}

RosPoseWithCovariance to_ros_pose(const Pose& X, const Matrix6d& covariance) {
  const Matrix6d J = ros_from_error_coordinates(X.rotation.toRotationMatrix());
  RosPoseWithCovariance out;
  out.pose = to_ros_pose(X);
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(out.covariance.data()) = J * covariance * J.transpose();
  return out;
}

Result<FrameTransforms> to_transforms(const RosTfMessage& message, std::size_t max_transforms, const PoseRules& rules) {
  if (message.transforms.size() > max_transforms) {
    return core::resource_exhausted("transforms: " + std::to_string(message.transforms.size()) +
                                    " are more than the limit of " + std::to_string(max_transforms));
  }
  FrameTransforms out;
  for (std::size_t i = 0; i < message.transforms.size(); ++i) {
    Result<FrameTransform> transform = to_transform(message.transforms[i], rules);
    if (transform) {
      out.accepted.push_back(*std::move(transform));
    } else {
      out.rejected.push_back(transform.status().at("transforms[" + std::to_string(i) + "]"));
    }
  }
  return out;
}

RosTransformStamped to_ros_transform(const FrameTransform& transform) {
  return {{to_ros_time(transform.stamp_ns), transform.parent}, transform.child, to_ros_transform(transform.X_PC)};
}

Result<std::vector<JointSample>> to_joint_samples(const RosJointState& state) {
  const std::size_t count = state.name.size();
  for (const auto& [field, values] : {std::pair("position", &state.position), std::pair("velocity", &state.velocity),
                                      std::pair("effort", &state.effort)}) {
    if (!values->empty() && values->size() != count) {
      return core::invalid_input(std::string(field) + ": has " + std::to_string(values->size()) + " entries for " +
                                 std::to_string(count) + " names; send none or one for each name");
    }
    for (std::size_t i = 0; i < values->size(); ++i) {
      if (std::isfinite((*values)[i])) continue;
      return core::invalid_input(std::string(field) + ": that of joint " + quote(state.name[i]) + " is " +
                                 number_text((*values)[i]) + "; leave the joint out when it is unknown");
    }
  }
  std::vector<JointSample> samples;
  std::set<std::string_view> seen;
  for (std::size_t i = 0; i < count; ++i) {
    if (!core::is_utf8(state.name[i])) {
      return core::invalid_input("name: joint " + quote(state.name[i]) + " is not UTF-8; use letters, digits and _");
    }
    if (state.name[i].empty()) return core::invalid_input("name[" + std::to_string(i) + "]: is empty; name the joint");
    if (!seen.insert(state.name[i]).second) {
      return core::invalid_input("name: joint " + quote(state.name[i]) + " stands twice; send each joint once");
    }
    if (state.position.empty()) continue;
    JointSample sample{state.name[i], state.position[i], std::nullopt, std::nullopt};
    if (!state.velocity.empty()) sample.velocity = state.velocity[i];
    if (!state.effort.empty()) sample.effort = state.effort[i];
    samples.push_back(std::move(sample));
  }
  return samples;
}

}  // namespace prescene::interfaces
