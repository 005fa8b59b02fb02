// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/planning_scene.h"

#include <algorithm>
#include <tuple>
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

std::string model_key(const std::string& name) { return "model " + name; }
std::string support_key(const std::string& name) { return "support " + name; }

bool is_of_scene(const std::string& key, const belief::Scene& scene) {
  return std::any_of(scene.models.begin(), scene.models.end(),
                     [&](const belief::ObjectModel& model) { return key == model_key(model.name); }) ||
         std::any_of(scene.supports.begin(), scene.supports.end(),
                     [&](const belief::Support& support) { return key == support_key(support.name); });
}

/// The object that is lost, or null.
const ObjectSummary* lost_object(const BeliefSummary& summary, const std::string& id) {
  const auto object = std::find_if(summary.objects.begin(), summary.objects.end(), [&](const ObjectSummary& o) {
    return o.state == belief::TrackState::kLost && kFramePrefix + o.name == id;
  });
  return object == summary.objects.end() ? nullptr : &*object;
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

/// What is to be in the planning scene.
struct PlanningScene::Placed {
  std::string id, type;
  ShapePtr shape;
  geometry::Pose X_W;
  bool is_held = false;
};

/// What the messages of one step are made of.
struct PlanningScene::Turn {
  const BeliefSummary& summary;
  const std::string& world_frame;
  const Send& send;
  std::vector<Placed> placed;

  const Placed* find(const std::string& id) const {
    const auto thing = std::find_if(placed.begin(), placed.end(), [&](const Placed& p) { return p.id == id; });
    return thing == placed.end() ? nullptr : &*thing;
  }
  bool sends(RosCollisionObject message, RosCollisionOperation operation, const std::string& id) const {
    message.header = {interfaces::to_ros_time(summary.stamp_ns), world_frame};
    message.id = id;
    message.operation = static_cast<std::uint8_t>(operation);
    return send(message);
  }
};

PlanningScene::ShapePtr PlanningScene::shape_of(const std::string& key,
                                                const std::vector<belief::CollisionShape>& shapes,
                                                const belief::Scene& scene) {
  const auto known = shapes_.find(key);
  if (known != shapes_.end() && known->second->shapes == shapes) {
    known->second->shapes = shapes;  // equal meshes in another place are compared only once
    return known->second;
  }
  std::erase_if(shapes_, [&](const auto& entry) { return !is_of_scene(entry.first, scene); });
  return shapes_[key] = std::make_shared<Shape>(Shape{shapes, collision_object_of(shapes, settings_.most_triangles)});
}

void PlanningScene::prepare(const belief::Scene& scene) {
  for (const belief::ObjectModel& model : scene.models) shape_of(model_key(model.name), model.collision, scene);
  if (!settings_.supports) return;
  for (const belief::Support& support : scene.supports) shape_of(support_key(support.name), support.collision, scene);
}

std::vector<PlanningScene::Placed> PlanningScene::placed_in(const BeliefSummary& summary, const belief::Scene& scene) {
  std::vector<Placed> placed;
  for (const ObjectSummary& object : summary.objects) {
    const auto model = std::find_if(scene.models.begin(), scene.models.end(),
                                    [&](const belief::ObjectModel& m) { return m.name == object.model; });
    if (model == scene.models.end() || object.state == belief::TrackState::kLost) continue;
    placed.push_back({kFramePrefix + object.name, object.model,
                      shape_of(model_key(model->name), model->collision, scene), object.X_WO,
                      object.held_by.has_value()});
  }
  if (!settings_.supports) return placed;
  for (const belief::Support& support : scene.supports)
    placed.push_back({kFramePrefix + support.name, "support",
                      shape_of(support_key(support.name), support.collision, scene), support.X_WS});
  return placed;
}

bool PlanningScene::removes(const Turn& turn, const std::string& id) {
  if (!turn.sends({}, RosCollisionOperation::kRemove, id)) return false;
  removed_[id] = turn.summary.stamp_ns;
  Known& known = known_.at(id);
  const ObjectSummary* lost = lost_object(turn.summary, id);
  if (!lost || !(known.is_held || lost->held_by)) {
    known_.erase(id);
    return true;
  }
  // A client may have attached it: in the world it would collide with itself when it is found in the hand.
  known.is_in_world = false;
  known.is_held = known.adds_anew = true;
  known.has_new_reader = false;
  return true;
}

bool PlanningScene::adds(const Turn& turn, const Placed& thing) {
  RosCollisionObject message = thing.shape->object;
  message.pose = interfaces::to_ros_pose(thing.X_W);
  message.type.key = thing.type;
  if (!turn.sends(std::move(message), RosCollisionOperation::kAdd, thing.id)) return false;
  removed_.erase(thing.id);
  known_[thing.id] = {.X_W = thing.X_W, .shape = thing.shape, .is_held = thing.is_held, .adds_anew = thing.is_held};
  return true;
}

bool PlanningScene::moves(const Turn& turn, const Placed& thing) {
  RosCollisionObject message;
  message.pose = interfaces::to_ros_pose(thing.X_W);
  if (!turn.sends(std::move(message), RosCollisionOperation::kMove, thing.id)) return false;
  known_.at(thing.id).X_W = thing.X_W;
  return true;
}

bool PlanningScene::repeats_one(const Turn& turn) {
  const core::TimeNs now_ns = turn.summary.stamp_ns;
  const auto is_due = [&](core::TimeNs then_ns) { return now_ns < then_ns || now_ns - then_ns >= settings_.repeat_ns; };
  if (!repeated_ns_ || now_ns < *repeated_ns_) repeated_ns_ = now_ns;
  if (!is_due(*repeated_ns_)) return false;
  const auto removed = std::find_if(removed_.begin(), removed_.end(), [&](const auto& r) { return is_due(r.second); });
  if (removed != removed_.end()) {
    if (!turn.sends({}, RosCollisionOperation::kRemove, removed->first)) return false;
    removed_.erase(removed);
    repeated_ns_ = now_ns;
    return true;
  }
  const Placed* next = nullptr;
  const auto order = [&](const Placed& thing) {
    return std::tuple<bool, const std::string&>(thing.id <= last_repeated_, thing.id);
  };
  for (const Placed& thing : turn.placed) {
    const auto known = known_.find(thing.id);
    if (known == known_.end() || thing.is_held || known->second.is_held) continue;
    if (!next || order(thing) < order(*next)) next = &thing;
  }
  if (!next || !adds(turn, *next)) return false;
  last_repeated_ = next->id;
  repeated_ns_ = now_ns;
  return true;
}

void PlanningScene::tell(const BeliefSummary& summary, const belief::Scene& scene, const std::string& world_frame,
                         const PlanningReaders& readers, const Send& send) {
  if (readers.so_far > std::exchange(readers_so_far_, readers.so_far))
    for (auto& [id, known] : known_) known.has_new_reader = known.is_in_world;
  if (readers.now == 0) return;
  const Turn turn{summary, world_frame, send, placed_in(summary, scene)};
  std::size_t sent = repeats_one(turn) ? 1 : 0;

  struct Due {
    Kind kind;
    std::string id;
    const Placed* thing;
  };
  std::vector<Due> due;
  // What was lost in a hand and is forgotten now is in no world any more.
  std::erase_if(known_, [&](const auto& entry) {
    return !entry.second.is_in_world && !turn.find(entry.first) && !lost_object(summary, entry.first);
  });
  for (const auto& [id, known] : known_)
    if (known.is_in_world && !turn.find(id)) due.push_back({kRemoval, id, nullptr});
  for (const Placed& thing : turn.placed) {
    const auto found = known_.find(thing.id);
    if (found == known_.end()) {
      due.push_back({kAddition, thing.id, &thing});
      continue;
    }
    Known& known = found->second;
    known.is_held = thing.is_held;
    // A client that attached it took it out of the world.
    if (thing.is_held) known.adds_anew = true;
    // What was found anew may have another shape.
    if (known.has_new_reader || (!thing.is_held && (known.adds_anew || known.shape != thing.shape)))
      due.push_back({kAddition, thing.id, &thing});
    else if (!thing.is_held && has_moved(known.X_W, thing.X_W, settings_))
      due.push_back({kMove, thing.id, &thing});
  }
  const auto order = [&](const Due& d) {
    return std::tuple<Kind, bool, const std::string&>(d.kind, d.id <= last_[d.kind], d.id);
  };
  std::sort(due.begin(), due.end(), [&](const Due& a, const Due& b) { return order(a) < order(b); });
  for (const Due& next : due) {
    if (sent >= settings_.most_at_once) return;
    const bool done = next.kind == kRemoval    ? removes(turn, next.id)
                      : next.kind == kAddition ? adds(turn, *next.thing)
                                               : moves(turn, *next.thing);
    if (!done) return;
    last_[next.kind] = next.id;
    ++sent;
  }
}

}  // namespace prescene::service
