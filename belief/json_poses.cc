// SPDX-License-Identifier: Apache-2.0
// JSON of rotations, poses and what is known of them, both ways, with the keys of scene files.
#include "json_values.h"
#include "prescene/belief/json.h"
#include "prescene/geometry/angles.h"

namespace prescene::belief {
namespace {

constexpr const char* kRotationForms =
    "give {\"quaternion_wxyz\": [w, x, y, z]}, {\"quaternion_xyzw\": [x, y, z, w]} as in ROS, "
    "{\"euler_deg\": [roll, pitch, yaw]} or {\"axis_angle_deg\": [x, y, z, angle]}";

geometry::Quaterniond quaternion_from(const JsonAt& at, bool real_part_first) {
  const std::vector<double> q = at.numbers(4);
  const geometry::Quaterniond read =
      real_part_first ? geometry::Quaterniond(q[0], q[1], q[2], q[3]) : geometry::Quaterniond(q[3], q[0], q[1], q[2]);
  const double error = std::abs(read.norm() - 1.0);
  if (!(error <= 0.01)) {
    at.fail(real_part_first ? "a unit quaternion [w, x, y, z] is needed" : "a unit quaternion [x, y, z, w] is needed");
    return geometry::Quaterniond::Identity();
  }
  // What we wrote comes back as the same bits; what a person rounded is made a unit quaternion.
  return error < 1e-9 ? read : read.normalized();
}

Json rotation_json(const geometry::Quaterniond& q) {
  return {{"quaternion_wxyz", {number_json(q.w()), number_json(q.x()), number_json(q.y()), number_json(q.z())}}};
}

geometry::Quaterniond rotation_from(const JsonAt& at) {
  if (!at.value.is_object()) {
    at.fail(std::string("a list does not say which number is the real part: ") + kRotationForms);
    return geometry::Quaterniond::Identity();
  }
  JsonObject object(at);
  const auto form = object.one_of({"quaternion_wxyz", "quaternion_xyzw", "euler_deg", "axis_angle_deg"});
  if (!form) return geometry::Quaterniond::Identity();
  if (form->first == "euler_deg") return geometry::rotation_from_euler_deg(vector_from(form->second));
  if (form->first != "axis_angle_deg") return quaternion_from(form->second, form->first == "quaternion_wxyz");
  const std::vector<double> numbers = form->second.numbers(4);
  const Vector3d axis(numbers[0], numbers[1], numbers[2]);
  if (!(axis.norm() > 1e-9)) {
    form->second.fail("an axis of some length is needed");
    return geometry::Quaterniond::Identity();
  }
  return geometry::Quaterniond(Eigen::AngleAxisd(geometry::kDegree * numbers[3], axis.normalized()));
}

/// Standard deviations: one number for all axes, or three.
Vector3d deviations_from(const JsonAt& at) {
  Vector3d deviations = at.value.is_array() ? vector_from(at) : Vector3d(Vector3d::Constant(at.number()));
  if (!(deviations.array() >= 0.0).all()) at.fail("a standard deviation is negative");
  return deviations;
}

NormalPose normal_from(const JsonAt& at, const Pose& mean) {
  NormalPose normal{mean, geometry::Matrix6d::Zero()};
  JsonObject fields(at);
  const auto position = fields.find("position"), rotation = fields.find("rotation_deg");
  if (const auto covariance = fields.find("covariance")) {
    if (position || rotation) covariance->fail("a covariance and deviations exclude each other: remove one of them");
    normal.covariance = matrix_from(*covariance, 6);
    return normal;
  }
  if (!position && !rotation) at.fail("give 'position' (m), 'rotation_deg' or 'covariance'");
  geometry::Vector6d deviations = geometry::Vector6d::Zero();
  if (rotation) deviations.head<3>() = geometry::kDegree * deviations_from(*rotation);
  if (position) deviations.tail<3>() = deviations_from(*position);
  normal.covariance = deviations.cwiseAbs2().asDiagonal();
  return normal;
}

}  // namespace

Json to_json(const Pose& pose) {
  return {{"position", vector_json(pose.translation)}, {"rotation", rotation_json(pose.rotation)}};
}

void read_pose(JsonObject& fields, Pose& pose) {
  if (const auto position = fields.find("position")) pose.translation = vector_from(*position);
  if (const auto rotation = fields.find("rotation")) pose.rotation = rotation_from(*rotation);
}

Pose pose_from(const JsonAt& at) {
  Pose pose;
  JsonObject object(at);
  if (!object.find("position") && !object.find("rotation")) at.fail("one of the keys position, rotation is needed");
  read_pose(object, pose);
  return pose;
}

Json pose_distribution_json(const PoseDistribution& distribution) {
  if (const auto* fixed = std::get_if<FixedPose>(&distribution)) return to_json(fixed->X_WO);
  if (const auto* normal = std::get_if<NormalPose>(&distribution)) {
    Json json = to_json(normal->mean);
    json["normal"] = {{"covariance", matrix_json(normal->covariance)}};
    return json;
  }
  if (const auto* box = std::get_if<BoxPose>(&distribution)) {
    return {{"position", vector_distribution_json(box->position)},
            {"rotation", box->any_rotation ? Json("any") : rotation_json(box->rotation)}};
  }
  Json samples = Json::array();
  for (const Pose& sample : std::get<SampledPose>(distribution).samples) samples.push_back(to_json(sample));
  return {{"samples", std::move(samples)}};
}

PoseDistribution pose_distribution_from(const JsonAt& at) {
  JsonObject fields(at);
  const auto samples = fields.find("samples"), position = fields.find("position"), rotation = fields.find("rotation"),
             normal = fields.find("normal");
  if (samples) {
    if (position || rotation || normal) samples->fail("samples exclude everything else: put it into the samples");
    SampledPose sampled;
    for (const JsonAt& item : samples->items()) sampled.samples.push_back(pose_from(item));
    if (sampled.samples.empty()) {
      samples->fail("at least one sample is needed");
      return FixedPose{};
    }
    return sampled;
  }
  if (!position && !rotation) at.fail("one of the keys position, rotation, samples is needed");
  BoxPose box;
  box.position = position ? vector_distribution_from(*position) : Vector3Distribution::fixed(Vector3d::Zero());
  if (rotation && rotation->value.is_string()) {
    box.any_rotation = rotation->word<bool>({{"any", true}});
  } else if (rotation) {
    box.rotation = rotation_from(*rotation);
  }
  const bool is_fixed = dimensions(box.position) == 0 && !box.any_rotation;
  const Pose middle{box.rotation, mean(box.position)};
  if (normal) {
    if (!is_fixed) normal->fail("it needs a position and a rotation in numbers as its mean");
    return normal_from(*normal, middle);
  }
  if (is_fixed) return FixedPose{middle};
  return box;
}

core::Result<Pose> pose_from_json(const Json& value) {
  JsonErrors errors;
  const Pose pose = pose_from({value, "", errors});
  if (!errors.ok()) return errors.status();
  return pose;
}

}  // namespace prescene::belief
