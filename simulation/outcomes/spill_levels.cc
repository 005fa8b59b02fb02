// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/spill_levels.h"

#include <algorithm>
#include <cmath>

#include "prescene/geometry/triangle_distance.h"

namespace prescene::simulation {
namespace {

using geometry::Vector3d;

constexpr double kCellsPerRadius = 3.0;
constexpr double kMostCells = 64.0;  // along an edge of the domain

}  // namespace

SpillLevels::SpillLevels(const std::vector<geometry::TriangleMesh>& surfaces, const geometry::Box& domain,
                         const SpillBall& ball, const Region& region, bool region_beyond) {
  const Vector3d extent = domain.sizes();
  size_ = std::max(ball.radius / kCellsPerRadius, extent.maxCoeff() / kMostCells);
  origin_ = domain.min();
  std::size_t total = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    count_[k] = std::max(1, static_cast<int>(std::ceil(extent[static_cast<Eigen::Index>(k)] / size_)));
    total *= static_cast<std::size_t>(count_[k]);
  }
  closed_.assign(total, 0);
  // The whole cell is too near when its centre is nearer by half its diagonal.
  const double distance = ball.radius - ball.slack - 0.5 * std::sqrt(3.0) * size_;
  if (distance > 0.0)
    for (const geometry::TriangleMesh& surface : surfaces) close_near(surface, distance);
  flood(region, region_beyond);
}

SpillLevels::SpillLevels(const SpillLevels& same_places, const Region& region, bool region_beyond)
    : origin_(same_places.origin_), size_(same_places.size_), count_(same_places.count_), closed_(same_places.closed_) {
  flood(region, region_beyond);
}

void SpillLevels::close_near(const geometry::TriangleMesh& surface, double distance) {
  for (const auto& triangle : surface.triangles) {
    const Vector3d &a = surface.vertices[triangle[0]], &b = surface.vertices[triangle[1]],
                   &c = surface.vertices[triangle[2]];
    const Vector3d low = a.cwiseMin(b).cwiseMin(c).array() - distance,
                   high = a.cwiseMax(b).cwiseMax(c).array() + distance;
    std::array<int, 3> first, last;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      const double most = count_[k] - 1.0;
      first[k] = static_cast<int>(std::clamp(std::floor((low[axis] - origin_[axis]) / size_), 0.0, most + 1.0));
      last[k] = static_cast<int>(std::clamp(std::floor((high[axis] - origin_[axis]) / size_), -1.0, most));
    }
    for (int k = first[2]; k <= last[2]; ++k)
      for (int j = first[1]; j <= last[1]; ++j)
        for (int i = first[0]; i <= last[0]; ++i) {
          std::uint8_t& closed = closed_[cell(i, j, k)];
          if (closed) continue;
          const Vector3d center = low_of(i, j, k).array() + 0.5 * size_;
          closed = geometry::squared_distance_to_triangle(center, a, b, c) < distance * distance;
        }
  }
}

void SpillLevels::flood(const Region& region, bool region_beyond) {
  levels_.assign(closed_.size(), kNone);
  // Bucket b holds what water reaches when it stands at layer b - 1; -1 is the open place beyond the grid.
  constexpr std::array<int, 3> kBeyond = {-1, -1, -1};
  std::vector<std::vector<std::array<int, 3>>> buckets(static_cast<std::size_t>(count_[2]) + 1);
  const auto reach = [&](int i, int j, int k, int water) {
    const std::size_t c = cell(i, j, k);
    const int level = std::max(water, k);
    if (closed_[c] || levels_[c] <= level) return;
    levels_[c] = level;
    buckets[static_cast<std::size_t>(level + 1)].push_back({i, j, k});
  };
  const auto reach_beyond = [&](int water) {
    if (beyond_ <= water) return;
    beyond_ = water;
    buckets[static_cast<std::size_t>(water + 1)].push_back(kBeyond);
  };
  if (region_beyond) reach_beyond(-1);
  std::vector<std::size_t> inside;
  for (int k = 0; k < count_[2]; ++k)
    for (int j = 0; j < count_[1]; ++j)
      for (int i = 0; i < count_[0]; ++i) {
        const Vector3d low = low_of(i, j, k);
        if (closed_[cell(i, j, k)] || !region(low, low.array() + size_)) continue;
        inside.push_back(cell(i, j, k));
        reach(i, j, k, k);
      }
  for (std::size_t b = 0; b < buckets.size(); ++b) {
    const int water = static_cast<int>(b) - 1;
    for (std::size_t n = 0; n < buckets[b].size(); ++n) {
      const auto [i, j, k] = buckets[b][n];
      if (i < 0) {
        for (int z = 0; z < count_[2]; ++z)
          for (int y = 0; y < count_[1]; ++y)
            for (int x = 0; x < count_[0]; ++x) {
              const bool border =
                  x == 0 || y == 0 || z == 0 || x == count_[0] - 1 || y == count_[1] - 1 || z == count_[2] - 1;
              if (border) reach(x, y, z, water);
            }
        continue;
      }
      if (levels_[cell(i, j, k)] < water) continue;
      const std::array<std::array<int, 3>, 6> next = {
          {{i - 1, j, k}, {i + 1, j, k}, {i, j - 1, k}, {i, j + 1, k}, {i, j, k - 1}, {i, j, k + 1}}};
      for (const auto& [x, y, z] : next) {
        const bool within = x >= 0 && y >= 0 && z >= 0 && x < count_[0] && y < count_[1] && z < count_[2];
        within ? reach(x, y, z, water) : reach_beyond(water);
      }
    }
  }
  for (const std::size_t c : inside) levels_[c] = -1;
}

double SpillLevels::height(int level) const {
  if (level == kNone) return std::numeric_limits<double>::infinity();
  if (level < 0) return -std::numeric_limits<double>::infinity();
  return origin_.z() + size_ * level;
}

double SpillLevels::level(const Vector3d& p) const {
  std::array<int, 3> at;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    const double where = std::floor((p[axis] - origin_[axis]) / size_);
    if (!(where >= 0.0 && where < count_[k])) return height(beyond_);
    at[k] = static_cast<int>(where);
  }
  const std::size_t c = cell(at[0], at[1], at[2]);
  return closed_[c] ? -std::numeric_limits<double>::infinity() : height(levels_[c]);
}

}  // namespace prescene::simulation
