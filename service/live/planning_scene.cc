// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/planning_scene.h"

#include <algorithm>
#include <set>
#include <utility>
#include <variant>

#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service {
namespace {

using interfaces::RosCollisionObject;
using interfaces::RosCollisionOperation;
using interfaces::RosPrimitiveType;

interfaces::RosSolidPrimitive solid(RosPrimitiveType type, std::vector<double> dimensions) {
  return {static_cast<std::uint8_t>(type), std::move(dimensions), {}};
}

/// Nothing of what MoveIt has no primitive for.
std::optional<interfaces::RosSolidPrimitive> solid_of(const geometry::Primitive& primitive) {
  if (const auto* sphere = std::get_if<geometry::Sphere>(&primitive))
    return solid(RosPrimitiveType::kSphere, {sphere->radius});
  if (const auto* box = std::get_if<geometry::BoxShape>(&primitive))
    return solid(RosPrimitiveType::kBox, {box->size.x(), box->size.y(), box->size.z()});
  if (const auto* cylinder = std::get_if<geometry::Cylinder>(&primitive))
    return solid(RosPrimitiveType::kCylinder, {cylinder->length, cylinder->radius});
  if (const auto* cone = std::get_if<geometry::Cone>(&primitive))
    return solid(RosPrimitiveType::kCone, {cone->length, cone->radius});
  return std::nullopt;
}

interfaces::RosMesh mesh_message(const geometry::TriangleMesh& mesh) {
  interfaces::RosMesh message;
  for (const auto& triangle : mesh.triangles) message.triangles.push_back({{triangle[0], triangle[1], triangle[2]}});
  for (const geometry::Vector3d& p : mesh.vertices) message.vertices.push_back({p.x(), p.y(), p.z()});
  return message;
}

bool has_moved(const geometry::Pose& from, const geometry::Pose& to, const PlanningSceneSettings& settings) {
  return (to.translation - from.translation).norm() > settings.moved ||
         to.rotation.angularDistance(from.rotation) > settings.turned;
}

/// What is to be in the planning scene.
struct Placed {
  std::string id, type;
  const std::vector<belief::CollisionShape>* shapes;
  geometry::Pose X_W;
  bool is_held = false;
};

std::vector<Placed> placed_in(const BeliefSummary& summary, const belief::Scene& scene, bool supports) {
  std::vector<Placed> placed;
  for (const ObjectSummary& object : summary.objects) {
    const auto model = std::find_if(scene.models.begin(), scene.models.end(),
                                    [&](const belief::ObjectModel& m) { return m.name == object.model; });
    if (model == scene.models.end() || object.state == belief::TrackState::kLost) continue;
    placed.push_back(
        {kFramePrefix + object.name, object.model, &model->collision, object.X_WO, object.held_by.has_value()});
  }
  if (!supports) return placed;
  for (const belief::Support& support : scene.supports)
    placed.push_back({kFramePrefix + support.name, "support", &support.collision, support.X_WS});
  return placed;
}

}  // namespace

RosCollisionObject collision_object_of(const std::vector<belief::CollisionShape>& shapes, int most_triangles) {
  RosCollisionObject object;
  for (const belief::CollisionShape& shape : shapes) {
    const auto* primitive = std::get_if<belief::PrimitiveShape>(&shape);
    if (const auto of_primitive = primitive ? solid_of(primitive->primitive) : std::nullopt) {
      object.primitives.push_back(*of_primitive);
      object.primitive_poses.push_back(interfaces::to_ros_pose(primitive->X_OS));
      continue;
    }
    const geometry::TriangleMesh mesh = belief::collision_mesh(std::vector{shape});
    object.meshes.push_back(
        mesh_message(std::ssize(mesh.triangles) > most_triangles ? geometry::simplified(mesh, most_triangles) : mesh));
    object.mesh_poses.push_back({});
  }
  return object;
}

std::vector<RosCollisionObject> PlanningScene::changes(const BeliefSummary& summary, const belief::Scene& scene,
                                                       const std::string& world_frame, int readers) {
  const bool has_new_reader = readers > std::exchange(readers_, readers);
  if (has_new_reader)
    for (auto& [id, sent] : sent_) sent.adds_anew = true;
  std::vector<RosCollisionObject> messages;
  if (readers == 0) return messages;
  const auto message_of = [&](RosCollisionObject message, RosCollisionOperation operation, const std::string& id) {
    message.header = {interfaces::to_ros_time(summary.stamp_ns), world_frame};
    message.id = id;
    message.operation = static_cast<std::uint8_t>(operation);
    return message;
  };
  const std::vector<Placed> placed = placed_in(summary, scene, settings_.supports);
  std::set<std::string> ids;
  for (const Placed& thing : placed) ids.insert(thing.id);
  for (auto sent = sent_.begin(); sent != sent_.end();) {
    if (ids.contains(sent->first) || messages.size() >= settings_.most_at_once) {
      ++sent;
      continue;
    }
    messages.push_back(message_of({}, RosCollisionOperation::kRemove, sent->first));
    sent = sent_.erase(sent);
  }
  for (const Placed& thing : placed) {
    if (messages.size() >= settings_.most_at_once) break;
    const auto sent = sent_.find(thing.id);
    const bool is_known = sent != sent_.end();
    if (is_known && thing.is_held) {
      sent->second.adds_anew = true;
      continue;
    }
    // A client that attached it took it out of the world; what was found anew may have another shape.
    const bool adds = !is_known || sent->second.adds_anew || sent->second.shapes != *thing.shapes;
    if (!adds && !has_moved(sent->second.X_W, thing.X_W, settings_)) continue;
    RosCollisionObject message =
        message_of(adds ? collision_object_of(*thing.shapes, settings_.most_triangles) : RosCollisionObject(),
                   adds ? RosCollisionOperation::kAdd : RosCollisionOperation::kMove, thing.id);
    message.pose = interfaces::to_ros_pose(thing.X_W);
    if (adds) message.type.key = thing.type;
    messages.push_back(std::move(message));
    Sent& now = sent_[thing.id];
    now.X_W = thing.X_W;
    if (adds) now.shapes = *thing.shapes;
    now.adds_anew = false;
  }
  return messages;
}

}  // namespace prescene::service
