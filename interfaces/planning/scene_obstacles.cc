// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/planning/scene_obstacles.h"

#include <algorithm>
#include <utility>

namespace prescene::interfaces {

core::Result<std::vector<Obstacle>> scene_obstacles(const belief::Scene& scene, const std::vector<std::string>& without,
                                                    core::ThreadPool& pool) {
  for (const std::string& name : without) {
    if (!belief::find_object(scene, name) && !belief::find_support(scene, name) &&
        !belief::find_robot_body(scene, name))
      return core::invalid_input("'" + name + "' is to be left out, but there is none in the scene: give its name");
  }
  std::vector<Obstacle> obstacles;
  const auto add = [&](const std::string& name, const std::vector<belief::CollisionShape>& shapes,
                       const geometry::Pose& X_WO) -> core::Status {
    if (shapes.empty() || std::find(without.begin(), without.end(), name) != without.end()) return core::ok_status();
    PRESCENE_TRY(PlanningShape shape, PlanningShape::of_shapes(shapes, name, pool));
    obstacles.push_back({name, std::move(shape), X_WO});
    return core::ok_status();
  };
  for (const belief::Support& support : scene.supports)
    PRESCENE_RETURN_IF_ERROR(add(support.name, support.collision, support.X_WS));
  for (const belief::KinematicBody& body : scene.robot)
    PRESCENE_RETURN_IF_ERROR(add(body.name, body.collision, belief::pose_at(body, 0.0)));
  const belief::WorldState start = belief::mean_start(scene);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const belief::SceneObject& object = scene.objects[i];
    PRESCENE_RETURN_IF_ERROR(add(object.name, scene.model_of(object).collision, start.objects[i].X_WO));
  }
  return obstacles;
}

}  // namespace prescene::interfaces
