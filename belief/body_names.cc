// SPDX-License-Identifier: Apache-2.0
#include "prescene/belief/body_names.h"

namespace prescene::belief {

std::optional<int> body_index(const Scene& scene, const std::string& name) {
  const auto objects = static_cast<int>(scene.objects.size());
  const auto supports = static_cast<int>(scene.supports.size());
  if (const auto object = find_object(scene, name)) return object;
  if (const auto support = find_support(scene, name)) return objects + *support;
  if (const auto robot = find_robot_body(scene, name)) return objects + supports + *robot;
  return std::nullopt;
}

std::string body_name(const Scene& scene, int index) {
  auto rest = static_cast<std::size_t>(index);
  if (rest < scene.objects.size()) return scene.objects[rest].name;
  rest -= scene.objects.size();
  if (rest < scene.supports.size()) return scene.supports[rest].name;
  rest -= scene.supports.size();
  if (rest < scene.robot.size()) return scene.robot[rest].name;
  rest -= scene.robot.size();
  return rest == 0 ? "pusher" : "pusher " + std::to_string(rest + 1);
}

bool is_moving(const ObjectState& state) {
  if (state.mode == MotionMode::kResting) return false;
  return state.V_WO.linear.norm() > kMovingSpeed || state.V_WO.angular.norm() > kMovingTurn;
}

Vector3d up_of(const Scene& scene) {
  const Vector3d& g = scene.gravity_W;
  if (g.isZero(0.0) || (g.x() == 0.0 && g.y() == 0.0 && g.z() < 0.0)) return Vector3d::UnitZ();
  return -g.normalized();
}

bool supports(const ContactInterval& contact, int lower, int upper) {
  constexpr double kFromBelow = 0.5;  // the normal is within 60 degrees of the vertical
  if (contact.first == upper && contact.second == lower) return contact.normal_z > kFromBelow;
  if (contact.first == lower && contact.second == upper) return contact.normal_z < -kFromBelow;
  return false;
}

}  // namespace prescene::belief
