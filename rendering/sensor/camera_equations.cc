// SPDX-License-Identifier: Apache-2.0
#include "prescene/rendering/sensor/camera_equations.h"

namespace prescene::rendering {

using geometry::Matrix6d;
using geometry::Vector6d;

PoseLinearisation in_body_axes(const CameraEquations& sums, const geometry::Pose& X_CO) {
  Matrix6d H;
  Vector6d g;
  std::size_t k = 0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    g[i] = sums.g[static_cast<std::size_t>(i)];
    for (Eigen::Index j = i; j < 6; ++j) H(i, j) = H(j, i) = sums.H[k++];
  }
  Matrix6d to_body = Matrix6d::Identity();
  to_body.topLeftCorner<3, 3>() = X_CO.rotation.toRotationMatrix().transpose();
  const Matrix6d turned = to_body * H * to_body.transpose();
  PoseLinearisation result;
  result.H = 0.5 * (turned + turned.transpose());
  result.g = to_body * g;
  result.pixels = sums.pixels;
  result.weight = sums.weight;
  result.squares = sums.squares;
  return result;
}

}  // namespace prescene::rendering
