// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/free_fall.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "prescene/core/check.h"

namespace prescene::simulation {

using geometry::Vector3d;

FreeFall measure_whole_fall(std::span<const TimedPose> frames, const Vector3d& center_of_mass,
                            const Vector3d& gravity_W, double position_noise) {
  PRESCENE_CHECK(frames.size() >= 3);
  const Vector3d down = gravity_W.normalized();
  const double middle = 0.5 * (frames.front().time + frames.back().time);
  const double half = 0.5 * (frames.back().time - frames.front().time);
  const auto n = static_cast<Eigen::Index>(frames.size());
  // In half windows, so that the equations are well conditioned.
  Eigen::MatrixX3d powers(n, 3);
  Eigen::VectorXd way(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const TimedPose& frame = frames[static_cast<std::size_t>(i)];
    const double t = (frame.time - middle) / half;
    powers.row(i) << 1.0, t, t * t;
    way[i] = down.dot(frame.X_WO * center_of_mass - frames.front().X_WO.translation);
  }
  const Eigen::Matrix3d inverse = (powers.transpose() * powers).inverse();
  const Vector3d fit = inverse * (powers.transpose() * way);
  const double scale = 2.0 / (half * half);
  return {scale * fit[2], scale * position_noise * std::sqrt(inverse(2, 2))};
}

FreeFall measure_fall(std::span<const TimedPose> frames, const Vector3d& center_of_mass, const Vector3d& gravity_W,
                      double position_noise) {
  PRESCENE_CHECK(frames.size() >= kLeastFallFrames);
  FreeFall fall;
  for (std::size_t n = kLeastFallFrames; n <= frames.size(); ++n) {
    if (n > kLeastFallFrames && frames[n - 1].time - frames[0].time > kFallWindow) break;
    fall = measure_whole_fall(frames.first(n), center_of_mass, gravity_W, position_noise);
    if (fall.error < gravity_W.norm() / 8.0) break;
  }
  return fall;
}

double position_noise_of(std::span<const std::span<const TimedPose>> recordings) {
  std::vector<double> differences;
  for (const std::span<const TimedPose> frames : recordings) {
    for (std::size_t i = 3; i < frames.size(); ++i) {
      const auto at = [&](std::size_t back) -> const Vector3d& { return frames[i - back].X_WO.translation; };
      if (at(0) == at(1)) continue;  // a tracker that says the same twice, of what lies still, does not tell its noise
      const Vector3d third = at(0) - 3.0 * at(1) + 3.0 * at(2) - at(3);
      for (const double value : third) differences.push_back(std::abs(value));
    }
  }
  if (differences.empty()) return 0.0;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::ranges::nth_element(differences, middle);
  // Its variance is 1 + 9 + 9 + 1 times that of a coordinate.
  return 1.4826 * *middle / std::sqrt(20.0);
}

}  // namespace prescene::simulation
