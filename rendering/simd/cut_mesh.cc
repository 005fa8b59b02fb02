// SPDX-License-Identifier: Apache-2.0
#include "cut_mesh.h"

#include <algorithm>
#include <cmath>

namespace prescene::rendering {
namespace {

Vector3f rotated(const PoseProjection& seen, const Vector3f& p) {
  const float* r = seen.rotation;
  return {r[0] * p.x() + r[1] * p.y() + r[2] * p.z(), r[3] * p.x() + r[4] * p.y() + r[5] * p.z(),
          r[6] * p.x() + r[7] * p.y() + r[8] * p.z()};
}

ScreenPoint projected(const PoseProjection& seen, const Vector3f& p_C) {
  const float inverse_depth = 1.0f / p_C.z();
  return snapped(seen.fx * p_C.x() * inverse_depth + seen.cx, seen.fy * p_C.y() * inverse_depth + seen.cy);
}

/// A face's plane n . p = distance in C, n turned to the camera.
struct Plane {
  Vector3f normal;
  float distance;
};

void draw_part(ScreenPoint a, ScreenPoint b, ScreenPoint c, const Plane& plane, const PoseProjection& seen,
               std::int32_t face, PoseTile* tile) {
  const float scale = 1.0f / plane.distance;
  const float along_x = plane.normal.x() * seen.inverse_fx * scale;
  const float along_y = plane.normal.y() * seen.inverse_fy * scale;
  const float at_centre = plane.normal.z() * scale;
  const PixelRect box = bounding_pixels(a, b, c, tile->rect);
  if (box.empty()) return;
  for_each_covered_pixel(a, b, c, box, [&](int x, int y) {
    const float linear =
        at_centre + along_x * (static_cast<float>(x) - seen.cx) + along_y * (static_cast<float>(y) - seen.cy);
    const float inverse_depth = std::max(tile->least_inverse_depth, std::min(tile->most_inverse_depth, linear));
    float& nearest = tile->inverse_depth(y)[x];
    if (inverse_depth <= nearest) return;
    nearest = inverse_depth;
    tile->face(y)[x] = face;
  });
}

}  // namespace

void draw_cut(const RenderMesh& mesh, const PoseProjection& seen, float near_depth, PoseTile* tile) {
  tile->rect = {0, 0, seen.width - 1, seen.height - 1};
  tile->clear();
  const Vector3f p_CO(seen.translation[0], seen.translation[1], seen.translation[2]);
  tile->most_inverse_depth = tile->least_inverse_depth = 1.0f / near_depth;
  for (const Vector3f& vertex : mesh.vertices) {
    const float z = (rotated(seen, vertex) + p_CO).z();
    if (z >= near_depth) tile->least_inverse_depth = std::min(tile->least_inverse_depth, 1.0f / z);
  }
  const MeshClusters& clusters = mesh.clusters;
  for (std::size_t i = 0; i < clusters.count * MeshClusters::kSize; ++i) {
    const std::size_t cluster = i / MeshClusters::kSize, first = cluster * MeshClusters::kSize;
    if (i - first >= clusters.triangles[cluster]) continue;
    const Vector3f normal_O(clusters.normal_x[i], clusters.normal_y[i], clusters.normal_z[i]);
    const float distance = normal_O.x() * seen.from_camera_O[0] + normal_O.y() * seen.from_camera_O[1] +
                           normal_O.z() * seen.from_camera_O[2] + clusters.offset[i];
    // Once it is cut, the inside of a closed mesh may be seen, too.
    if (distance == 0.0f) continue;
    Plane plane{rotated(seen, normal_O), -std::abs(distance)};
    if (distance > 0.0f) plane.normal = -plane.normal;
    const auto corner = [&](std::int32_t vertex) -> Vector3f {
      const std::size_t v = first + static_cast<std::size_t>(vertex);
      return rotated(seen, {clusters.x[v], clusters.y[v], clusters.z[v]}) + p_CO;
    };
    const Vector3f corners[3] = {corner(clusters.a[i]), corner(clusters.b[i]), corner(clusters.c[i])};
    Vector3f polygon[4];
    const int count = clip_to_near(corners, near_depth, polygon);
    if (count < 3) continue;
    tile->distance[i] = plane.distance;
    for (int k = 2; k < count; ++k)
      draw_part(projected(seen, polygon[0]), projected(seen, polygon[k - 1]), projected(seen, polygon[k]), plane, seen,
                static_cast<std::int32_t>(i), tile);
  }
}

}  // namespace prescene::rendering
