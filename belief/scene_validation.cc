// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <set>

#include "prescene/belief/scene.h"
#include "prescene/belief/validation.h"
#include "scene_checks.h"

namespace prescene::belief {
namespace {

using core::invalid_input;
using core::not_found;
using core::Status;

Status check_depth_noise(const DepthNoiseSettings& noise) {
  if (const auto sigma = noise.sigma_per_depth_squared; sigma && !(*sigma > 0.0 && *sigma <= 1.0))
    return invalid_input("sigma_per_depth_squared of " + std::to_string(*sigma) + ": give more than 0 and at most 1");
  const auto check_share = [](const char* what, double share) {
    if (share >= 0.0 && share < 1.0) return Status();
    return invalid_input(std::string(what) + " of " + std::to_string(share) + ": give at least 0 and less than 1");
  };
  if (noise.incidence_knee) PRESCENE_RETURN_IF_ERROR(check_share("incidence_knee", *noise.incidence_knee));
  if (noise.incidence_missing)
    for (const double share : *noise.incidence_missing)
      PRESCENE_RETURN_IF_ERROR(check_share("incidence_missing", share));
  if (noise.outline_missing)
    for (const double share : *noise.outline_missing) PRESCENE_RETURN_IF_ERROR(check_share("outline_missing", share));
  return {};
}

Status check_unique(const Scene& scene) {
  std::set<std::string> models, things;
  for (const ObjectModel& model : scene.models)
    if (!models.insert(model.name).second)
      return invalid_input("two models are called '" + model.name + "': rename one");
  const auto add = [&](const std::string& name) -> Status {
    if (things.insert(name).second) return {};
    return invalid_input("two of the objects, supports and robot bodies are called '" + name + "': rename one");
  };
  for (const SceneObject& object : scene.objects) PRESCENE_RETURN_IF_ERROR(add(object.name));
  for (const Support& support : scene.supports) PRESCENE_RETURN_IF_ERROR(add(support.name));
  for (const KinematicBody& body : scene.robot) PRESCENE_RETURN_IF_ERROR(add(body.name));
  return {};
}

Status check_support(const Support& support) {
  PRESCENE_RETURN_IF_ERROR(check_name(support.name));
  PRESCENE_RETURN_IF_ERROR(check_shapes(support.collision));
  PRESCENE_RETURN_IF_ERROR(check_pose(support.X_WS));
  PRESCENE_RETURN_IF_ERROR(check_contact(support.contact));
  return check_color(support.color);
}

Status check_robot_body(const KinematicBody& body) {
  PRESCENE_RETURN_IF_ERROR(check_name(body.name));
  PRESCENE_RETURN_IF_ERROR(check_shapes(body.collision));
  PRESCENE_RETURN_IF_ERROR(check_contact(body.contact));
  PRESCENE_RETURN_IF_ERROR(check_color(body.color));
  if (body.timeline.empty()) return invalid_input("its timeline is empty: give at least one pose");
  for (std::size_t i = 0; i < body.timeline.size(); ++i) {
    PRESCENE_RETURN_IF_ERROR(check_pose(body.timeline[i].X_WG).at("timeline"));
    if (!std::isfinite(body.timeline[i].time)) return invalid_input("a time is not a number: give seconds");
    if (i > 0 && !(body.timeline[i].time > body.timeline[i - 1].time))
      return invalid_input("the times of its timeline do not grow: sort them and make them differ");
  }
  return {};
}

Status check_object(const Scene& scene, const SceneObject& object) {
  PRESCENE_RETURN_IF_ERROR(check_name(object.name));
  if (object.model < 0 || object.model >= std::ssize(scene.models))
    return not_found("its model " + std::to_string(object.model) +
                     " is not among the scene's models: name one of them");
  PRESCENE_RETURN_IF_ERROR(check_pose(object.pose).at("pose"));
  PRESCENE_RETURN_IF_ERROR(check_vector(object.twist.angular, kSpeedRange).at("angular velocity"));
  PRESCENE_RETURN_IF_ERROR(check_vector(object.twist.linear, kSpeedRange).at("velocity"));
  if (object.held_by && !find_robot_body(scene, *object.held_by))
    return not_found("there is no robot body '" + *object.held_by +
                     "' to hold it: name one of the scene's robot bodies");
  return {};
}

Status check_cameras(const Scene& scene) {
  if (!scene.camera && !scene.more_cameras.empty()) return invalid_input("cameras: there are more, but no first one");
  if (scene.more_cameras.size() >= kMostCameras)
    return invalid_input("cameras: there are more than " + std::to_string(kMostCameras));
  std::set<std::string> names;
  for (int i = 0; scene.camera && i < camera_count(scene); ++i) {
    const SceneCamera& camera = *camera_at(scene, i);
    const std::string place = scene.more_cameras.empty() ? "camera" : quoted("camera", camera.name);
    if (!names.insert(camera.name).second) return invalid_input("two have this name: rename one").at(place);
    PRESCENE_RETURN_IF_ERROR(geometry::validate(camera.intrinsics).at(place));
    PRESCENE_RETURN_IF_ERROR(check_pose(camera.X_WC).at(place));
    PRESCENE_RETURN_IF_ERROR(check_depth_noise(camera.depth_noise).at("depth_noise").at(place));
  }
  return core::ok_status();
}

}  // namespace

std::string quoted(const char* what, const std::string& name) { return std::string(what) + " '" + name + "'"; }

Status check_finite_positive(double value, const char* what) {
  if (!(value > 0.0) || !(value <= 1e6))
    return invalid_input(std::string(what) + " of " + std::to_string(value) + ": give more than 0 and at most 1e6");
  return {};
}

Status check_object_name(const Scene& scene, const std::string& name) {
  if (!find_object(scene, name)) return not_found("there is no object '" + name + "': name one of the scene's objects");
  return {};
}

Status validate(const Scene& scene) {
  for (const ObjectModel& model : scene.models) PRESCENE_RETURN_IF_ERROR(validate(model));
  PRESCENE_RETURN_IF_ERROR(check_unique(scene));
  for (const Support& support : scene.supports)
    PRESCENE_RETURN_IF_ERROR(check_support(support).at(quoted("support", support.name)));
  for (const KinematicBody& body : scene.robot)
    PRESCENE_RETURN_IF_ERROR(check_robot_body(body).at(quoted("robot body", body.name)));
  for (const SceneObject& object : scene.objects)
    PRESCENE_RETURN_IF_ERROR(check_object(scene, object).at(quoted("object", object.name)));
  PRESCENE_RETURN_IF_ERROR(validate_joints(scene));
  PRESCENE_RETURN_IF_ERROR(check_cameras(scene));
  PRESCENE_RETURN_IF_ERROR(check_depth_noise(scene.depth_noise).at("depth_noise"));
  if (!scene.gravity_W.allFinite()) return invalid_input("gravity is not finite: give m/s^2");
  PRESCENE_RETURN_IF_ERROR(check_finite_positive(scene.duration, "a duration"));
  double last = 0.0;
  for (const Action& action : scene.actions) {
    const std::string place = "action " + kind_of(action);
    if (!(action.time >= last) || !std::isfinite(action.time))
      return invalid_input("its time is before 0 or before that of the action above: sort the actions by time")
          .at(place);
    last = action.time;
    PRESCENE_RETURN_IF_ERROR(check_action(scene, action).at(place));
  }
  return check_outcomes(scene);
}

}  // namespace prescene::belief
