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

void draw_part(ScreenPoint a, ScreenPoint b, ScreenPoint c, const PoseProjection& seen, std::int32_t face,
               PoseTile* tile) {
  const auto index = static_cast<std::size_t>(face);
  const float scale = 1.0f / tile->distance[index];
  const float along_x = tile->normal_x[index] * seen.inverse_fx * scale;
  const float along_y = tile->normal_y[index] * seen.inverse_fy * scale;
  const float at_centre = tile->normal_z[index] * scale;
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
  tile->faces = 0;
  const Vector3f p_CO(seen.translation[0], seen.translation[1], seen.translation[2]);
  tile->most_inverse_depth = tile->least_inverse_depth = 1.0f / near_depth;
  for (const Vector3f& vertex : mesh.vertices) {
    const float z = (rotated(seen, vertex) + p_CO).z();
    if (z >= near_depth) tile->least_inverse_depth = std::min(tile->least_inverse_depth, 1.0f / z);
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vector3f& normal_O = mesh.normals[i];
    const float distance = normal_O.x() * seen.from_camera_O[0] + normal_O.y() * seen.from_camera_O[1] +
                           normal_O.z() * seen.from_camera_O[2] + mesh.offsets[i];
    // Once it is cut, the inside of a closed mesh may be seen, too.
    if (distance == 0.0f) continue;
    Vector3f normal = rotated(seen, normal_O);
    if (distance > 0.0f) normal = -normal;
    Vector3f corners[3];
    for (std::size_t k = 0; k < 3; ++k) corners[k] = rotated(seen, mesh.vertices[mesh.triangles[i][k]]) + p_CO;
    Vector3f polygon[4];
    const int count = clip_to_near(corners, near_depth, polygon);
    if (count < 3) continue;
    const std::size_t face = tile->faces++;
    tile->distance[face] = -std::abs(distance);
    tile->normal_x[face] = normal.x();
    tile->normal_y[face] = normal.y();
    tile->normal_z[face] = normal.z();
    for (int k = 2; k < count; ++k)
      draw_part(projected(seen, polygon[0]), projected(seen, polygon[k - 1]), projected(seen, polygon[k]), seen,
                static_cast<std::int32_t>(face), tile);
  }
}

}  // namespace prescene::rendering
