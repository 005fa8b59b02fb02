// SPDX-License-Identifier: Apache-2.0
#include "prescene/geometry/surface_tree.h"

#include <vector>

#include "box_tree.h"
#include "prescene/core/check.h"

namespace prescene::geometry {
namespace {

std::vector<BoxTree::ItemBox> boxes_of(const TriangleMesh& mesh) {
  PRESCENE_CHECK(!mesh.triangles.empty());
  std::vector<BoxTree::ItemBox> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    boxes.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
  }
  return boxes;
}

}  // namespace

struct SurfaceTree::Tree {
  BoxTree boxes;
};

SurfaceTree::SurfaceTree(const TriangleMesh& mesh)
    : mesh_(&mesh), tree_(std::make_unique<const Tree>(Tree{BoxTree(boxes_of(mesh), 4)})) {}
SurfaceTree::~SurfaceTree() = default;
SurfaceTree::SurfaceTree(SurfaceTree&&) noexcept = default;

PlaceInTriangle SurfaceTree::place_in(std::uint32_t triangle, const Vector3d& p) const {
  const auto& t = mesh_->triangles[triangle];
  return nearest_in_triangle(p, mesh_->vertices[t[0]], mesh_->vertices[t[1]], mesh_->vertices[t[2]]);
}

SurfaceTree::Nearest SurfaceTree::nearest(const Vector3d& p, std::uint32_t hint) const {
  Nearest best{hint, place_in(hint, p)};
  // A box may be off by rounding where a triangle is as near as the best; the search must not leave it out.
  const auto bound_of = [](double squared) { return squared * (1.0 + 1e-12); };
  double bound = bound_of(best.place.squared_distance);
  tree_->boxes.search(p, bound, [&](std::size_t leaf, std::uint32_t begin) {
    for (std::uint32_t i = begin; i < tree_->boxes.leaf_begins()[leaf + 1]; ++i) {
      const std::uint32_t triangle = tree_->boxes.order()[i];
      const PlaceInTriangle place = place_in(triangle, p);
      const double squared = place.squared_distance;
      const bool nearer = squared < best.place.squared_distance;
      if (!nearer && !(squared == best.place.squared_distance && triangle < best.triangle)) continue;
      best = {triangle, place};
      bound = bound_of(squared);
    }
  });
  return best;
}

bool SurfaceTree::is_within(const Vector3d& p, double distance) const {
  double bound = distance * distance;
  bool found = false;
  tree_->boxes.search(p, bound, [&](std::size_t leaf, std::uint32_t begin) {
    for (std::uint32_t i = begin; i < tree_->boxes.leaf_begins()[leaf + 1] && !found; ++i)
      found = place_in(tree_->boxes.order()[i], p).squared_distance <= bound;
    if (found) bound = -1.0;
  });
  return found;
}

}  // namespace prescene::geometry
