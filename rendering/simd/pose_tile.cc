// SPDX-License-Identifier: Apache-2.0
#include "pose_tile.h"

#include <algorithm>

namespace prescene::rendering {

PoseProjection::PoseProjection(const geometry::Pose& X_CO, const geometry::PinholeCamera& camera)
    : fx(static_cast<float>(camera.fx)),
      fy(static_cast<float>(camera.fy)),
      cx(static_cast<float>(camera.cx)),
      cy(static_cast<float>(camera.cy)),
      inverse_fx(static_cast<float>(1.0 / camera.fx)),
      inverse_fy(static_cast<float>(1.0 / camera.fy)),
      width(camera.width),
      height(camera.height) {
  const geometry::Matrix3d R = X_CO.rotation.toRotationMatrix();
  const geometry::Vector3d p_O = X_CO.rotation.conjugate() * X_CO.translation;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rotation[3 * row + column] = static_cast<float>(R(row, column));
    translation[row] = static_cast<float>(X_CO.translation[row]);
    from_camera_O[row] = static_cast<float>(p_O[row]);
  }
}

void PoseTile::reserve(const RenderMesh& mesh, int width, int height) {
  const std::size_t places = mesh.clusters.x.size() + kSlack;
  if (distance.size() < places) {
    cluster.resize(mesh.clusters.count + kSlack);
    screen_x.resize(places);
    screen_y.resize(places);
    distance.resize(places);
  }
  if (width == width_ && height == height_) return;
  width_ = width;
  height_ = height;
  stride_ = (static_cast<std::size_t>(width) + 2 * kSlack + kSlack - 1) / kSlack * kSlack;
  const std::size_t size = stride_ * static_cast<std::size_t>(height + 2) + kSlack;
  inverse_depth_.assign(size, 1.0f);
  face_.assign(size, 0);
  rect = {0, 0, width - 1, height - 1};
  clear();
}

void PoseTile::clear() {
  if (rect.empty()) return;
  const int x_first = std::max(0, rect.x_first - 1);
  const int x_end = std::min(width_, rect.x_last + 2);
  for (int y = std::max(0, rect.y_first - 1); y <= std::min(height_ - 1, rect.y_last + 1); ++y)
    std::fill(inverse_depth(y) + x_first, inverse_depth(y) + x_end, 0.0f);
}

}  // namespace prescene::rendering
