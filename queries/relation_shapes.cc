// SPDX-License-Identifier: Apache-2.0
#include "relation_shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "prescene/collision/point_queries.h"
#include "prescene/collision/ray_queries.h"
#include "prescene/geometry/angles.h"
#include "prescene/geometry/resting_poses.h"
#include "prescene/queries/relations.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Vector3d;

/// Of these some 40 % face a camera: shares are good to some 6 %.
constexpr int kSurfacePoints = 192;
/// Every third is enough to tell whether half of a surface is in a hollow, where all directions are looked along.
constexpr std::size_t kInsideStride = 3;
/// Half of them, and the others opposite: a plane lets through just half of them.
constexpr int kHalfDirections = 32;
/// m: nearer than this to its end, a ray to a point has come to the point's own surface.
constexpr double kOwnSurface = 5e-4;
/// How far the face that a model rests on may be from -z of its frame.
constexpr double kModelTilt = 15.0 * geometry::kDegree;

std::vector<Vector3d> directions_and_opposites() {
  std::vector<Vector3d> directions;
  const double turn = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < kHalfDirections; ++i) {
    const double z = (i + 0.5) / kHalfDirections;
    const double r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(turn * i), r * std::sin(turn * i), z);
    directions.push_back(-directions.back());
  }
  return directions;
}

/// Which way is up in the model's frame, by the face that it rests on.
Vector3d axis_of(const belief::ObjectModel& model, const geometry::TriangleMesh& mesh) {
  const auto resting = geometry::resting_poses(mesh, belief::mean(model.center_of_mass));
  if (!resting) return Vector3d::UnitZ();
  Vector3d best = Vector3d::UnitZ();
  double most = std::cos(kModelTilt);
  for (const geometry::RestingPose& pose : *resting) {
    const Vector3d up_B = pose.R_WB.conjugate() * Vector3d::UnitZ();
    if (up_B.z() < most) continue;
    most = up_B.z();
    best = up_B;
  }
  return best;
}

double angle_between_axes(const Vector3d& a, const Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Whether a ball may lie in the way from p to q.
bool may_hide(const Vector3d& center, double radius, const Vector3d& p, const Vector3d& q) {
  const Vector3d way = q - p;
  const double t = std::clamp((center - p).dot(way) / std::max(1e-12, way.squaredNorm()), 0.0, 1.0);
  return (p + t * way - center).squaredNorm() <= radius * radius;
}

}  // namespace

core::Result<RelationShapes> RelationShapes::make(const belief::Scene& scene, core::ThreadPool& pool) {
  RelationShapes shapes;
  shapes.directions_ = directions_and_opposites();
  const auto add = [&](const std::string& name, const geometry::TriangleMesh& mesh) -> core::Status {
    PRESCENE_TRY(auto rounded, collision::Mesh::make(mesh, name));
    Body body{collision::TriangleTree::build(std::move(rounded), {}, pool),
              geometry::sample_surface(mesh, kSurfacePoints, 1),
              geometry::bounding_box(mesh),
              Vector3d::Zero(),
              0.0,
              geometry::mesh_topology(mesh).bounds_volume(),
              {},
              {},
              Vector3d::UnitZ()};
    body.center = body.box.center();
    body.radius = geometry::radius_about(mesh, body.center);
    shapes.bodies_.push_back(std::move(body));
    return core::ok_status();
  };
  for (const belief::SceneObject& object : scene.objects) {
    const belief::ObjectModel& model = scene.model_of(object);
    const geometry::TriangleMesh mesh = belief::collision_mesh(model);
    PRESCENE_RETURN_IF_ERROR(add(object.name, mesh));
    Body& body = shapes.bodies_.back();
    body.hollow = model.hollow;
    body.symmetry = model.symmetry;
    body.axis = axis_of(model, mesh);
  }
  for (const belief::Support& support : scene.supports) {
    PRESCENE_RETURN_IF_ERROR(add(support.name, belief::collision_mesh(support.collision)));
    shapes.bodies_.back().hollow = support.hollow;
  }
  for (const belief::KinematicBody& body : scene.robot)
    PRESCENE_RETURN_IF_ERROR(add(body.name, belief::collision_mesh(body.collision)));
  return shapes;
}

std::vector<Pose> RelationShapes::poses(const belief::Scene& scene, const belief::WorldState& state) const {
  std::vector<Pose> X_WB;
  X_WB.reserve(bodies_.size());
  for (const belief::ObjectState& object : state.objects) X_WB.push_back(object.X_WO);
  for (const belief::Support& support : scene.supports) X_WB.push_back(support.X_WS);
  for (const belief::KinematicBody& body : scene.robot) X_WB.push_back(belief::pose_at(body, 0.0));
  return X_WB;
}

double RelationShapes::lowest(std::size_t body, const Pose& X_WB, const Vector3d& up_W) const {
  const Eigen::Vector3f up_B = (X_WB.rotation.conjugate() * up_W).cast<float>();
  float least = std::numeric_limits<float>::infinity();
  for (const Eigen::Vector3f& vertex : bodies_[body].tree.mesh().vertices()) least = std::min(least, up_B.dot(vertex));
  return up_W.dot(X_WB.translation) + static_cast<double>(least);
}

bool RelationShapes::is_inside(const Body& outer, const Vector3d& p, collision::QueryScratch& scratch) const {
  if (outer.hollow) {
    const Vector3d p_V = outer.hollow->X_OV.inverse() * p;
    if ((p_V.cwiseAbs().array() <= 0.5 * outer.hollow->size.array()).all()) return true;
  }
  if (!outer.box.contains(p)) return false;
  const auto wanted = static_cast<int>(std::ceil(kEnclosed * static_cast<double>(directions_.size())));
  int met = 0, left = static_cast<int>(directions_.size());
  constexpr std::size_t kPacket = 16;
  std::array<collision::Ray, kPacket> rays;
  std::array<bool, kPacket> hits{};
  for (std::size_t first = 0; first < directions_.size() && met + left >= wanted; first += kPacket) {
    for (std::size_t i = 0; i < kPacket; ++i) rays[i] = {p, directions_[first + i], 1e-6};
    collision::any_hits(outer.tree, rays, hits, scratch);
    met += static_cast<int>(std::count(hits.begin(), hits.end(), true));
    left -= static_cast<int>(kPacket);
  }
  return met >= wanted && !(outer.solid && collision::winding_number(outer.tree, p) > 0);
}

double RelationShapes::share_inside(std::size_t inner, std::size_t outer, const std::vector<Pose>& X_WB,
                                    collision::QueryScratch& scratch) const {
  const Body& hollow = bodies_[outer];
  const Pose X_OI = X_WB[outer].inverse() * X_WB[inner];
  const Vector3d center = X_OI * bodies_[inner].center;
  if (hollow.box.exteriorDistance(center) > bodies_[inner].radius && !hollow.hollow) return 0.0;
  const std::vector<geometry::SurfacePoint>& points = bodies_[inner].points;
  int inside = 0, looked_at = 0;
  for (std::size_t i = 0; i < points.size(); i += kInsideStride, ++looked_at)
    inside += is_inside(hollow, X_OI * points[i].position, scratch) ? 1 : 0;
  return static_cast<double>(inside) / looked_at;
}

double RelationShapes::visible_share(std::size_t body, const geometry::PinholeCamera& camera, const Pose& X_WC,
                                     const std::vector<Pose>& X_WB, collision::QueryScratch& scratch) const {
  const Body& seen = bodies_[body];
  const Vector3d p_WC = X_WC.translation;
  const Pose X_CW = X_WC.inverse();
  double all = 0.0, unhidden = 0.0;
  for (const geometry::SurfacePoint& point : seen.points) {
    const Vector3d p_W = X_WB[body] * point.position;
    const Vector3d way = p_W - p_WC;
    const double distance = way.norm();
    // Area in the image: foreshortened, and less the farther away.
    const double facing = -(X_WB[body].rotation * point.normal).dot(way);
    if (!(facing > 0.0)) continue;
    const double pixels = facing / (distance * distance * distance);
    const auto is_met = [&](std::size_t other) {
      const Pose X_BW = X_WB[other].inverse();
      const collision::Ray ray{X_BW * p_WC, X_BW.rotation * way, 0.0, 1.0 - kOwnSurface / distance};
      return collision::any_hit(bodies_[other].tree, ray, scratch);
    };
    if (is_met(body)) continue;  // its own far side is none of its pixels
    all += pixels;
    const Vector3d p_C = X_CW * p_W;
    if (p_C.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = camera.project(p_C);
    if (pixel.x() < -0.5 || pixel.y() < -0.5 || pixel.x() > camera.width - 0.5 || pixel.y() > camera.height - 0.5)
      continue;
    bool hidden = false;
    for (std::size_t other = 0; other < bodies_.size() && !hidden; ++other) {
      if (other == body) continue;
      hidden = may_hide(X_WB[other] * bodies_[other].center, bodies_[other].radius, p_WC, p_W) && is_met(other);
    }
    if (!hidden) unhidden += pixels;
  }
  return all > 0.0 ? unhidden / all : 0.0;
}

bool RelationShapes::is_within(std::size_t body, const Pose& X_WB, const Vector3d& p_W, double distance) const {
  const Body& of = bodies_[body];
  const Vector3d p_B = X_WB.inverse() * p_W;
  if (collision::is_within(of.tree, p_B, distance)) return true;
  return of.solid && collision::winding_number(of.tree, p_B) > 0;
}

std::optional<double> RelationShapes::tilt(std::size_t object, const Pose& X_WB, const Vector3d& up_W) const {
  const Body& body = bodies_[object];
  if (body.symmetry.ball) return std::nullopt;
  const Vector3d up_B = X_WB.rotation.conjugate() * up_W;
  const auto tilt_of = [&](const Vector3d& axis) {
    if (!body.symmetry.axis) return angle_between_axes(axis, up_B);
    // Any turn about the axis of symmetry looks the same.
    const Vector3d& k = *body.symmetry.axis;
    return std::abs(angle_between_axes(axis, k) - angle_between_axes(up_B, k));
  };
  double least = tilt_of(body.axis);
  for (const geometry::Quaterniond& rotation : body.symmetry.rotations)
    least = std::min(least, tilt_of(rotation * body.axis));
  return least;
}

}  // namespace prescene::queries
