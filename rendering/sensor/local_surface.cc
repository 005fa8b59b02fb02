// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/local_surface.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "chamfer.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::rendering {

using geometry::Vector3d;

namespace {

double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Change of depth a pixel to the right (or down) in the middle of the pairs of neighbours in a window; 0 = unknown.
double slope(const geometry::DepthImage& depth, int x, int y, int window, int dx, int dy) {
  std::vector<double> changes;
  for (int v = std::max(0, y - window); v <= std::min(depth.height() - 1 - dy, y + window - dy); ++v)
    for (int u = std::max(0, x - window); u <= std::min(depth.width() - 1 - dx, x + window - dx); ++u) {
      const double a = depth(u, v), b = depth(u + dx, v + dy);
      if (a > 0.0 && b > 0.0) changes.push_back(b - a);
    }
  return changes.empty() ? 0.0 : median_of(changes);
}

}  // namespace

std::optional<LocalSurface> local_surface(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera,
                                          int x, int y, const LocalSurfaceOptions& options) {
  const int side = 2 * options.window + 1;
  const double fewest = options.fewest * (side * side - 1);
  const double right_slope = slope(depth, x, y, options.window, 1, 0);
  const double down_slope = slope(depth, x, y, options.window, 0, 1);
  std::vector<Vector3d> offsets;  // (dx, dy, depth)
  std::vector<double> levels;     // depths less what the slope explains
  for (int dy = -options.window; dy <= options.window; ++dy)
    for (int dx = -options.window; dx <= options.window; ++dx) {
      if ((dx == 0 && dy == 0) || x + dx < 0 || y + dy < 0 || x + dx >= depth.width() || y + dy >= depth.height())
        continue;
      const double z = depth(x + dx, y + dy);
      if (!(z > 0.0)) continue;
      offsets.emplace_back(dx, dy, z);
      levels.push_back(z - right_slope * dx - down_slope * dy);
    }
  if (levels.empty() || static_cast<double>(levels.size()) < fewest) return std::nullopt;
  const double middle = median_of(levels);
  geometry::Matrix3d H = geometry::Matrix3d::Zero();
  Vector3d g = Vector3d::Zero();
  int used = 0;
  for (const Vector3d& offset : offsets) {
    const double level = offset.z() - right_slope * offset.x() - down_slope * offset.y();
    if (std::abs(level - middle) > options.same_surface) continue;
    const Vector3d row(1.0, offset.x(), offset.y());
    H += row * row.transpose();
    g += row * offset.z();
    ++used;
  }
  if (used < fewest) return std::nullopt;
  const Vector3d plane = geometry::solve_symmetric_3(H, g);  // depth, its change a pixel to the right, and a pixel down
  if (!plane.allFinite() || std::abs(plane[0] - middle) > options.same_surface) return std::nullopt;
  const Vector3d ray = camera.unproject(x, y, 1.0);
  const Vector3d right = plane[1] * ray + plane[0] / camera.fx * Vector3d::UnitX();
  const Vector3d down = plane[2] * ray + plane[0] / camera.fy * Vector3d::UnitY();
  return LocalSurface{plane[0], std::abs(right.cross(down).normalized().dot(ray.normalized()))};
}

geometry::Image<float> distance_to_marked(const geometry::Image<std::uint8_t>& marked) {
  constexpr float kFar = 1e6f;
  const int width = marked.width(), height = marked.height();
  geometry::Image<float> distance(width, height, kFar);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (marked(x, y) != 0) distance(x, y) = 0.0f;
  const auto relax = [&](int x, int y, int dx, int dy, float length) {
    if (x + dx < 0 || y + dy < 0 || x + dx >= width || y + dy >= height) return;
    distance(x, y) = std::min(distance(x, y), distance(x + dx, y + dy) + length);
  };
  sweep_neighbours(width, height, relax);
  return distance;
}

}  // namespace prescene::rendering
