// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/motion_units.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "prescene/core/order_statistics.h"
#include "prescene/core/text.h"
#include "prescene/geometry/dense_solvers.h"

namespace prescene::service {
namespace {

// s of a recording that are looked at.
constexpr double kBeginning = 0.15;
constexpr std::size_t kLeastFrames = 5;
constexpr double kFastest = 100.0;  // m/s
// In gravities: what bounces within the beginning stays below.
constexpr double kMostAcceleration = 30.0;
constexpr double kLongestStep = 0.5;  // s

struct Movement {
  double speed = 0.0;         // m/s
  double acceleration = 0.0;  // m/s^2
};

/// Of the parabola through the first frames.
std::optional<Movement> beginning_of(const std::vector<simulation::TimedPose>& frames) {
  std::size_t count = 0;
  while (count < frames.size() && (count < kLeastFrames || frames[count].time - frames[0].time <= kBeginning)) ++count;
  if (count < kLeastFrames) return std::nullopt;
  const double middle = 0.5 * (frames[0].time + frames[count - 1].time);
  const auto n = static_cast<Eigen::Index>(count);
  Eigen::MatrixX3d powers(n, 3);
  Eigen::MatrixX3d places(n, 3);
  for (std::size_t i = 0; i < count; ++i) {
    const double t = frames[i].time - middle;
    powers.row(static_cast<Eigen::Index>(i)) << 1.0, t, t * t;
    places.row(static_cast<Eigen::Index>(i)) = frames[i].X_WO.translation.transpose();
  }
  const Eigen::Matrix3d fit = geometry::solve_least_squares(powers, places);
  return Movement{fit.row(1).norm(), 2.0 * fit.row(2).norm()};
}

}  // namespace

double frame_rate(const std::vector<MotionRecording>& recordings) {
  std::vector<double> rates;
  for (const MotionRecording& recording : recordings) {
    const auto& frames = recording.frames;
    if (frames.size() > 1)
      rates.push_back(static_cast<double>(frames.size() - 1) / (frames.back().time - frames.front().time));
  }
  return rates.empty() ? 0.0 : core::upper_median(std::move(rates));
}

core::Status check_units(const std::vector<MotionRecording>& recordings, double gravity) {
  const double rate = frame_rate(recordings);
  if (rate > 0.0 && 1.0 / rate >= kLongestStep) {
    return core::invalid_input("the typical recording has " + core::rounded_text(1.0 / rate) +
                               " s between its frames: t must be in seconds; if it is in milliseconds divide it by "
                               "1000, if it counts frames by their rate");
  }
  std::vector<double> speeds;
  std::vector<double> accelerations;
  for (const MotionRecording& recording : recordings) {
    const std::optional<Movement> movement = beginning_of(recording.frames);
    if (!movement) continue;
    speeds.push_back(movement->speed);
    accelerations.push_back(movement->acceleration);
  }
  if (speeds.empty()) return core::ok_status();
  const double speed = core::upper_median(std::move(speeds));
  const double acceleration = core::upper_median(std::move(accelerations));
  if (speed < kFastest && acceleration < kMostAcceleration * gravity) return core::ok_status();
  return core::invalid_input("the typical recording begins with " + core::rounded_text(speed) + " m/s, changing by " +
                             core::rounded_text(acceleration) +
                             " m/s^2: x, y, z must be in metres; if they are in millimetres divide them by 1000, if in "
                             "centimetres by 100");
}

}  // namespace prescene::service
