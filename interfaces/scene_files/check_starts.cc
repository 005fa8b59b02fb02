// SPDX-License-Identifier: Apache-2.0
// Objects that begin in the middle of a support or outside of the world: what a simulator makes of them is no
// prediction.
#include <algorithm>
#include <cmath>

#include "prescene/belief/scene_size.h"
#include "prescene/core/text.h"
#include "read_scene_parts.h"

namespace prescene::interfaces {
namespace {

using geometry::Vector3d;

bool is_in(const geometry::Sphere& ball, const Vector3d& p) { return p.norm() < ball.radius; }
bool is_in(const geometry::BoxShape& box, const Vector3d& p) {
  return (p.array().abs() < 0.5 * box.size.array()).all();
}
bool is_in(const geometry::Cylinder& c, const Vector3d& p) {
  return p.head<2>().norm() < c.radius && std::abs(p.z()) < 0.5 * c.length;
}
bool is_in(const geometry::Capsule& c, const Vector3d& p) {
  const double z = std::clamp(p.z(), -0.5 * c.length, 0.5 * c.length);
  return (p - z * Vector3d::UnitZ()).norm() < c.radius;
}
bool is_in(const geometry::Cone& c, const Vector3d& p) {
  return std::abs(p.z()) < 0.5 * c.length && p.head<2>().norm() < c.radius * (0.5 - p.z() / c.length);
}

/// Of shapes that are solid without doubt: primitives, and hulls.
class Solid {
 public:
  explicit Solid(const belief::CollisionShape& shape) : shape_(shape) {
    const auto* mesh = std::get_if<belief::MeshShape>(&shape);
    if (!mesh || mesh->use != belief::MeshUse::kConvexHull) return;
    if (auto hull = geometry::convex_hull(mesh->mesh->vertices)) hull_ = *std::move(hull);
  }

  bool holds(const Vector3d& p_O) const {
    if (const auto* placed = std::get_if<belief::PrimitiveShape>(&shape_)) {
      const Vector3d p = placed->X_OS.inverse() * p_O;
      return std::visit([&](const auto& primitive) { return is_in(primitive, p); }, placed->primitive);
    }
    const Vector3d p = std::get<belief::MeshShape>(shape_).X_OS.inverse() * p_O;
    return !hull_.triangles.empty() && std::all_of(hull_.triangles.begin(), hull_.triangles.end(), [&](const auto& t) {
      const Vector3d& a = hull_.vertices[static_cast<std::size_t>(t[0])];
      const Vector3d& b = hull_.vertices[static_cast<std::size_t>(t[1])];
      const Vector3d& c = hull_.vertices[static_cast<std::size_t>(t[2])];
      return (b - a).cross(c - a).dot(p - a) < 0.0;
    });
  }

 private:
  const belief::CollisionShape& shape_;
  geometry::TriangleMesh hull_;
};

const LocatedValue& pose_of(const LocatedValue& object) {
  for (const char* key : {"pose", "pose_in_camera"})
    if (const LocatedValue* pose = object.find(key)) return *pose;
  return object;
}

void refuse_starts_inside(const LocatedValue& objects, const belief::Scene& scene, const belief::WorldState& start,
                          Problems& problems) {
  for (const belief::Support& support : scene.supports) {
    for (const belief::CollisionShape& shape : support.collision) {
      const Solid solid(shape);
      for (std::size_t o = 0; o < scene.objects.size(); ++o) {
        if (belief::are_jointed(scene, scene.objects[o].name, support.name)) continue;  // a drawer in its cabinet
        const geometry::Pose X_SO = support.X_WS.inverse() * start.objects[o].X_WO;
        if (!solid.holds(X_SO.translation)) continue;  // saves most of the work
        const geometry::TriangleMesh mesh = belief::collision_mesh(scene.model_of(scene.objects[o]));
        const bool inside = std::all_of(mesh.vertices.begin(), mesh.vertices.end(),
                                        [&](const Vector3d& vertex) { return solid.holds(X_SO * vertex); });
        if (!inside) continue;
        const LocatedValue& at = pose_of(*objects.find(scene.objects[o].name));
        problems.add(at.place, at.path, "it starts wholly inside the support '" + support.name + "'",
                     "move it out: positions are those of the object's origin, often its middle, in metres");
      }
    }
  }
}

// Simulators freeze what is there.
void refuse_starts_outside(const LocatedValue& objects, const belief::Scene& scene, const belief::WorldState& start,
                           Problems& problems) {
  const double radius = belief::world_radius(scene);
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const Vector3d& p = start.objects[o].X_WO.translation;
    if (p.norm() <= radius) continue;
    const LocatedValue& pose = pose_of(*objects.find(scene.objects[o].name));
    const LocatedValue* position = pose.find("position");
    const LocatedValue& at = position ? *position : pose;
    const Vector3d meant = 1e-3 * p;
    problems.add(at.place, at.path,
                 "it starts " + core::rounded_text(p.norm()) + " m from the world's origin, and the world ends at " +
                     core::rounded_text(radius) + " m",
                 meant.norm() < 0.5 * radius
                     ? "millimetres? then write [" + core::rounded_text(meant.x()) + ", " +
                           core::rounded_text(meant.y()) + ", " + core::rounded_text(meant.z()) +
                           "]; else put the origin near the things"
                     : "put the origin near the things");
  }
}

}  // namespace

void refuse_starts(const LocatedValue& document, const belief::Scene& scene, Problems& problems) {
  const LocatedValue* named = document.find("objects");
  if (!named) return;  // new ones are looked for
  const LocatedValue& objects = *named;
  const belief::WorldState start = belief::mean_start(scene);
  refuse_starts_outside(objects, scene, start, problems);
  refuse_starts_inside(objects, scene, start, problems);
}

}  // namespace prescene::interfaces
