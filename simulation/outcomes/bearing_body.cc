// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/bearing_body.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "prescene/collision/mesh.h"
#include "prescene/collision/point_queries.h"
#include "prescene/collision/spheres/surface_spheres.h"
#include "prescene/collision/triangle_tree.h"

namespace prescene::simulation {
namespace {

using geometry::Pose;

// Of things of household size:
// m: faces are not moved further inwards than this.
constexpr double kMostInset = 1e-3;
constexpr int kHalvings = 10;
// m: what bears may end this much above the polytope. Between the directions that are looked at it is that much again.
constexpr double kShort = 2e-5;
constexpr int kDirections = 4000;
// m: surfaces come this near to each other before solvers part them.
constexpr double kSunk = 1e-3;

/// The part of a surface that a sphere stands for when it meets a plane, as contacts with spheres have it.
struct BearingPatch {
  Vector3d centre, point, normal;
  double radius = 0.0;
  double reach = 0.0;
  bool is_edge = false;
};

std::vector<Vector3d> directions_over_the_sphere() {
  std::vector<Vector3d> directions;
  const double turn = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kDirections;
    const double r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(turn * i), r * std::sin(turn * i), z);
  }
  return directions;
}

double reach_of(const std::vector<Vector3d>& vertices, const Vector3d& direction) {
  double most = -std::numeric_limits<double>::infinity();
  for (const Vector3d& v : vertices) most = std::max(most, direction.dot(v));
  return most;
}

double reach_of(const std::vector<BearingPatch>& patches, const Vector3d& direction) {
  double most = -std::numeric_limits<double>::infinity();
  for (const BearingPatch& patch : patches) {
    const double reach = direction.dot(patch.centre) + patch.radius;
    if (reach <= most || (!patch.is_edge && patch.normal.dot(direction) <= 0.0)) continue;
    const Vector3d lowest = patch.centre + patch.radius * direction;
    if (patch.is_edge || (lowest - patch.point).squaredNorm() <= patch.reach * patch.reach) most = reach;
  }
  return most;
}

void append_patches(const collision::SurfaceSpheres& spheres, const Pose& X_OS, std::vector<BearingPatch>& patches) {
  for (const collision::SurfacePatch& patch : spheres.patches)
    patches.push_back({X_OS * patch.centre.cast<double>(), X_OS * patch.point.cast<double>(),
                       X_OS.rotation * patch.normal.cast<double>(), static_cast<double>(patch.radius),
                       static_cast<double>(patch.reach), patch.is_edge()});
}

/// Distance of a place inside of a closed mesh to its surface; 0 outside.
core::Result<double> depth_in(const geometry::TriangleMesh& mesh, const Vector3d& p) {
  PRESCENE_TRY(auto single, collision::Mesh::make(mesh, "of what bears"));
  core::ThreadPool alone(1);
  const auto tree = collision::TriangleTree::build(std::move(single), {}, alone);
  if (collision::winding_number(tree, p) <= 0) return 0.0;
  const auto nearest = collision::nearest_point(tree, p);
  return nearest ? nearest->distance : 0.0;
}

}  // namespace

std::optional<BearingBody> bearing_body(const std::vector<belief::CollisionShape>& shapes, const ConvexPolytope& hull,
                                        const Vector3d& center_of_mass_O, ShapeStore& store, double length_scale) {
  BearingBody body;
  std::vector<BearingPatch> patches;
  std::vector<Vector3d> vertices;  // of what has no spheres
  for (const belief::CollisionShape& shape : shapes) {
    const auto* mesh = std::get_if<belief::MeshShape>(&shape);
    if (!mesh || mesh->use != belief::MeshUse::kSpheres) {
      const std::vector<Vector3d> more = belief::collision_mesh({shape}).vertices;
      vertices.insert(vertices.end(), more.begin(), more.end());
      continue;
    }
    const auto spheres = store.surface_spheres(mesh->mesh, mesh->spheres);
    if (!spheres) return std::nullopt;
    append_patches(**spheres, mesh->X_OS, patches);
    body.rise = std::max(body.rise, static_cast<double>((*spheres)->rise));
    const auto depth = depth_in(*mesh->mesh, mesh->X_OS.inverse() * center_of_mass_O);
    if (!depth) return std::nullopt;
    body.inner_radius = std::max(body.inner_radius, *depth - kSunk * length_scale);
  }

  std::vector<Vector3d> directions = directions_over_the_sphere();
  for (const ConvexPolytope::Face& face : hull.faces) directions.push_back(face.normal);
  std::vector<double> reaches;
  reaches.reserve(directions.size());
  for (const Vector3d& direction : directions)
    reaches.push_back(std::max(reach_of(vertices, direction), reach_of(patches, direction)));
  const auto holds = [&](const ConvexPolytope& polytope) {
    for (std::size_t i = 0; i < directions.size(); ++i)
      if (reach_of(polytope.vertices, directions[i]) > reaches[i] + kShort * length_scale) return false;
    return true;
  };
  double low = 0.0, high = kMostInset * length_scale;
  std::optional<ConvexPolytope> best = inset(hull, high);
  if (!best || !holds(*best)) return std::nullopt;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    std::optional<ConvexPolytope> tried = inset(hull, middle);
    if (tried && holds(*tried)) {
      high = middle;
      best = std::move(tried);
    } else {
      low = middle;
    }
  }
  body.polytope = *std::move(best);
  return body;
}

}  // namespace prescene::simulation
