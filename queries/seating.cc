// SPDX-License-Identifier: Apache-2.0
#include "seating.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::queries {
namespace {

using belief::Pose;
using geometry::Vector3d;

/// Frames without motion after which an object is taken to lie still: a third of a second.
constexpr int kStillFrames = 10;
/// m; an object that lies still is drawn no further from where it lies.
constexpr double kNear = 0.1;
/// By which what a body reaches from its origin is taken for more than it is, for rounding.
constexpr double kReachMargin = 1.001;
/// Finer meshes are not looked at by ray: what lies on them starts where it was drawn.
constexpr std::size_t kMostTriangles = 20'000;

/// Where the line from p down (unit) meets the triangle a b c, as the distance; upward faces only.
std::optional<double> distance_down(const Vector3d& p, const Vector3d& down, const Vector3d& a, const Vector3d& b,
                                    const Vector3d& c, Vector3d* normal) {
  const Vector3d n = (b - a).cross(c - a);
  const double towards = -n.dot(down);
  if (!(towards > 1e-12 * n.norm())) return std::nullopt;
  const double distance = n.dot(p - a) / towards;
  const Vector3d q = p + distance * down;
  for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)})
    if (n.dot((to - from).cross(q - from)) < -1e-9 * n.squaredNorm()) return std::nullopt;
  *normal = n.normalized();
  return distance;
}

/// Whether a vertical line near one of these places may meet the triangle.
bool is_below_any(const std::vector<Vector3d>& places_W, const geometry::TriangleMesh& mesh,
                  const std::array<std::uint32_t, 3>& triangle, const Vector3d& up_W) {
  const Vector3d& a = mesh.vertices[triangle[0]];
  const Vector3d centre = (a + mesh.vertices[triangle[1]] + mesh.vertices[triangle[2]]) / 3.0;
  double radius = kNear;
  for (const std::uint32_t corner : triangle)
    radius = std::max(radius, kNear + (mesh.vertices[corner] - centre).norm());
  return std::ranges::any_of(places_W, [&](const Vector3d& p_W) {
    const Vector3d between = p_W - centre;
    return (between - up_W * up_W.dot(between)).norm() <= radius;
  });
}

bool lies_still(const belief::ObjectBelief& object, const belief::SceneObject& known) {
  return object.state == belief::TrackState::kTracked && object.motion.still_frames >= kStillFrames && !known.held_by;
}

}  // namespace

Seating::Seating(const belief::Belief& belief, const belief::Scene& scene) {
  if (!(scene.gravity_W.norm() > 0.0)) return;
  up_W_ = -scene.gravity_W.normalized();
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    Body& body = bodies_.emplace_back();
    // What hangs on a joint lies where that holds it.
    body.lies_still =
        lies_still(belief.objects[i], scene.objects[i]) && !belief::joint_of(scene, scene.objects[i].name);
    any_ = any_ || body.lies_still;
  }
  if (!any_) return;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const belief::ObjectModel& model = scene.model_of(scene.objects[i]);
    bodies_[i].mesh = belief::collision_mesh(model);
    bodies_[i].p_OoOcm = belief::mean(model.center_of_mass);
    for (const Vector3d& vertex : bodies_[i].mesh.vertices)
      bodies_[i].reach = std::max(bodies_[i].reach, kReachMargin * vertex.norm());
    if (!bodies_[i].lies_still) continue;
    if (auto resting = geometry::resting_poses(bodies_[i].mesh, bodies_[i].p_OoOcm))
      bodies_[i].resting = *std::move(resting);
  }
  std::vector<Vector3d> places_W;
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    if (bodies_[i].lies_still) places_W.push_back(belief.objects[i].motion.X_still * bodies_[i].p_OoOcm);
  for (const belief::Support& support : scene.supports) {
    geometry::TriangleMesh mesh = geometry::transformed(belief::collision_mesh(support.collision), support.X_WS);
    std::erase_if(mesh.triangles, [&](const auto& triangle) { return !is_below_any(places_W, mesh, triangle, up_W_); });
    if (mesh.triangles.size() <= kMostTriangles) supports_.push_back(std::move(mesh));
  }
}

std::optional<Seating::Ground> Seating::below(const Vector3d& p_W, std::size_t object,
                                              const belief::WorldState& state) const {
  const Vector3d down = -up_W_;
  double nearest = std::numeric_limits<double>::infinity();
  std::optional<Ground> ground;
  const auto look_at = [&](const geometry::TriangleMesh& mesh, const Pose& X_WM) {
    for (const auto& t : mesh.triangles) {
      Vector3d normal = Vector3d::UnitZ();
      const auto distance = distance_down(p_W, down, X_WM * mesh.vertices[t[0]], X_WM * mesh.vertices[t[1]],
                                          X_WM * mesh.vertices[t[2]], &normal);
      if (!distance || *distance < 0.0 || *distance >= nearest) continue;
      nearest = *distance;
      ground = Ground{p_W + *distance * down, normal};
    }
  };
  for (const geometry::TriangleMesh& support : supports_) look_at(support, Pose::identity());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (i == object || bodies_[i].mesh.triangles.size() > kMostTriangles) continue;
    // What lies beside the vertical line is not below.
    const Vector3d between = p_W - state.objects[i].X_WO.translation;
    if ((between - up_W_ * up_W_.dot(between)).norm() <= bodies_[i].reach)
      look_at(bodies_[i].mesh, state.objects[i].X_WO);
  }
  return ground;
}

void Seating::apply(belief::WorldState& state) const {
  if (!any_) return;
  // What lies on another is seated after it.
  std::vector<std::size_t> order(bodies_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return up_W_.dot(state.objects[a].X_WO * bodies_[a].p_OoOcm) <
           up_W_.dot(state.objects[b].X_WO * bodies_[b].p_OoOcm);
  });
  for (const std::size_t i : order) {
    const Body& body = bodies_[i];
    if (!body.lies_still) continue;
    belief::ObjectState& object = state.objects[i];
    object.V_WO = {};
    object.mode = belief::MotionMode::kResting;
    const Vector3d p_WCm = object.X_WO * body.p_OoOcm;
    const std::optional<Ground> ground = below(p_WCm, i, state);
    if (!ground || body.resting.empty()) continue;
    const auto down_of = [&](const geometry::RestingPose& pose) -> Vector3d {
      return object.X_WO.rotation * (pose.R_WB.conjugate() * -Vector3d::UnitZ());
    };
    const auto best = std::max_element(body.resting.begin(), body.resting.end(), [&](const auto& a, const auto& b) {
      return -ground->normal_W.dot(down_of(a)) < -ground->normal_W.dot(down_of(b));
    });
    const Vector3d face = down_of(*best);
    const double gap = ground->normal_W.dot(p_WCm - ground->point_W) - best->height;
    if (std::acos(std::clamp(-ground->normal_W.dot(face), -1.0, 1.0)) > kMostTilt || std::abs(gap) > kMostGap) continue;
    const geometry::Quaterniond turn = geometry::rotation_between(face, -ground->normal_W);
    object.X_WO.rotation = (turn * object.X_WO.rotation).normalized();
    object.X_WO.translation = p_WCm - gap * ground->normal_W - object.X_WO.rotation * body.p_OoOcm;
  }
}

}  // namespace prescene::queries
