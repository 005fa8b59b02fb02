// SPDX-License-Identifier: Apache-2.0
#include "edge_spheres.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>
#include <tuple>
#include <utility>

#include "hull_gap.h"
#include "prescene/core/check.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

// The room for a sphere about a centre that a float holds. Not inlined: where g++ 12 sees both conversions of a vector,
// from double to float and back, its vectorizer drops them.
[[gnu::noinline]] double room_at(const SurfaceSearch& surface, const std::vector<PackedSphere>& nearby,
                                 const Vector3f& centre) {
  const Vector3d x = centre.cast<double>();
  double room = std::sqrt(surface.nearest(x).squared_distance);
  for (const PackedSphere& sphere : nearby)
    room = std::min(room, (sphere.centre.cast<double>() - x).norm() - static_cast<double>(sphere.radius));
  return surface.winding(x) > 0 ? room : -std::sqrt(surface.nearest(x).squared_distance);
}

// About the largest sphere beside the others whose centre is within `reach` of the corner; radius 0 when there is none.
PackedSphere largest_near(const SurfaceSearch& surface, const std::vector<PackedSphere>& nearby, const Vector3d& corner,
                          double reach) {
  constexpr int kMostCells = 4000;
  constexpr double kEnough = 0.85;
  struct Cell {
    double bound;
    int index;
    Vector3d centre;
    double half;
    bool operator<(const Cell& other) const { return std::tuple(bound, other.index) < std::tuple(other.bound, index); }
  };
  std::priority_queue<Cell> queue;
  PackedSphere best;
  double best_room = 0.0;
  int count = 0;
  const auto look = [&](const Vector3d& centre, double half) {
    const Vector3f rounded = centre.cast<float>();
    const double room = room_at(surface, nearby, rounded);
    if (room > best_room) {
      best_room = room;
      best.centre = rounded;
    }
    if (room + std::numbers::sqrt3 * half > 0.0) queue.push({room + std::numbers::sqrt3 * half, count, centre, half});
    ++count;
  };
  look(corner, reach / std::numbers::sqrt3);
  while (!queue.empty() && count < kMostCells && best_room < kEnough * queue.top().bound) {
    const Cell cell = queue.top();
    queue.pop();
    for (unsigned octant = 0; octant < 8; ++octant) {
      const Vector3d sign((octant & 1U) != 0 ? 1.0 : -1.0, (octant & 2U) != 0 ? 1.0 : -1.0,
                          (octant & 4U) != 0 ? 1.0 : -1.0);
      look(cell.centre + 0.5 * cell.half * sign, 0.5 * cell.half);
    }
  }
  best.radius = best_room > 0.0 ? std::nextafter(static_cast<float>(best_room), 0.0F) : 0.0F;
  return best;
}

std::vector<PackedSphere> spheres_near(const std::vector<PackedSphere>& spheres, const Vector3d& p, double reach) {
  std::vector<PackedSphere> near;
  for (const PackedSphere& sphere : spheres) {
    if ((sphere.centre.cast<double>() - p).norm() - static_cast<double>(sphere.radius) < reach) near.push_back(sphere);
  }
  return near;
}

struct Lack {
  double gap;
  std::size_t corner;
};

// Those corners that are too far from the hull, the farthest first.
std::vector<Lack> lacking(const std::vector<Lack>& asked, const std::vector<Vector3d>& corners,
                          const std::vector<PackedSphere>& spheres, double fidelity, core::ThreadPool& pool) {
  std::vector<Lack> all = asked;
  pool.for_blocks(all.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) all[i].gap = hull_gap(corners[all[i].corner], spheres, fidelity).high;
  });
  std::erase_if(all, [&](const Lack& lack) { return lack.gap <= fidelity; });
  std::sort(all.begin(), all.end(),
            [](const Lack& a, const Lack& b) { return std::tuple(-a.gap, a.corner) < std::tuple(-b.gap, b.corner); });
  return all;
}

}  // namespace

std::vector<Vector3d> hull_corners(const std::vector<Vector3f>& vertices,
                                   const std::vector<TriangleIndices>& triangles) {
  std::vector<bool> used(vertices.size(), false);
  for (const TriangleIndices& t : triangles) {
    for (const std::uint32_t v : t) used[v] = true;
  }
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (used[i]) points.emplace_back(vertices[i].cast<double>());
  }
  const auto hull = geometry::convex_hull(points);
  return hull.ok() ? hull->vertices : points;
}

EdgeResult place_edge_spheres(VoidSearch& voids, const SurfaceSearch& surface, const std::vector<Vector3d>& corners,
                              double fidelity, double smallest, std::size_t max_spheres, core::ThreadPool& pool) {
  PRESCENE_CHECK(!voids.spheres().empty());
  EdgeResult result;
  std::vector<Lack> open(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) open[i].corner = i;
  while (true) {
    open = lacking(open, corners, voids.spheres(), fidelity, pool);
    if (open.empty()) return result;
    // A few at a time: each sphere may bring the hull near to further corners.
    const std::size_t most = std::max<std::size_t>(8, open.size() / 4);
    const std::size_t before = voids.spheres().size();
    for (const Lack& lack : open) {
      if (voids.spheres().size() >= before + most) break;
      const Vector3d& corner = corners[lack.corner];
      // Where no sphere is within the fidelity of this corner there is room, as far as the body goes; where one is, the
      // next round finds the corner served.
      const std::vector<PackedSphere> nearby = spheres_near(voids.spheres(), corner, 2.0 * fidelity);
      if (!spheres_near(nearby, corner, fidelity).empty()) continue;
      if (voids.spheres().size() >= max_spheres) {
        result.unserved = open.size();
        return result;
      }
      const PackedSphere sphere = largest_near(surface, nearby, corner, fidelity);
      if (static_cast<double>(sphere.radius) < smallest) {
        result.too_thin = corner;
        return result;
      }
      voids.insert(sphere);
      ++result.placed;
    }
  }
}

}  // namespace prescene::collision
