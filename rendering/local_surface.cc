// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/local_surface.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace prescene::rendering {

using geometry::Vector3d;

std::optional<LocalSurface> local_surface(const geometry::DepthImage& depth, const geometry::PinholeCamera& camera,
                                          int x, int y, const LocalSurfaceOptions& options) {
  const int side = 2 * options.window + 1;
  const double fewest = options.fewest * (side * side - 1);
  std::vector<Vector3d> offsets;  // (dx, dy, depth)
  std::vector<double> depths;
  for (int dy = -options.window; dy <= options.window; ++dy)
    for (int dx = -options.window; dx <= options.window; ++dx) {
      if ((dx == 0 && dy == 0) || x + dx < 0 || y + dy < 0 || x + dx >= depth.width() || y + dy >= depth.height())
        continue;
      const double z = depth(x + dx, y + dy);
      if (!(z > 0.0)) continue;
      offsets.emplace_back(dx, dy, z);
      depths.push_back(z);
    }
  if (depths.empty() || static_cast<double>(depths.size()) < fewest) return std::nullopt;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  geometry::Matrix3d H = geometry::Matrix3d::Zero();
  Vector3d g = Vector3d::Zero();
  int used = 0;
  for (const Vector3d& offset : offsets) {
    if (std::abs(offset.z() - *middle) > options.same_surface) continue;
    const Vector3d row(1.0, offset.x(), offset.y());
    H += row * row.transpose();
    g += row * offset.z();
    ++used;
  }
  if (used < fewest) return std::nullopt;
  const Vector3d plane = H.ldlt().solve(g);  // depth, its change a pixel to the right, and a pixel down
  if (!plane.allFinite() || std::abs(plane[0] - *middle) > options.same_surface) return std::nullopt;
  const Vector3d ray = camera.unproject(x, y, 1.0);
  const Vector3d right = plane[1] * ray + plane[0] / camera.fx * Vector3d::UnitX();
  const Vector3d down = plane[2] * ray + plane[0] / camera.fy * Vector3d::UnitY();
  return LocalSurface{plane[0], std::abs(right.cross(down).normalized().dot(ray.normalized()))};
}

}  // namespace prescene::rendering
