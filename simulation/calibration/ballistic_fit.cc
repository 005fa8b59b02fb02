// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/ballistic_fit.h"

#include <cmath>
#include <numbers>
#include <vector>

namespace prescene::simulation {
namespace {

using geometry::Pose;
using geometry::Vector3d;

/// value(t) = at_last + slope * (t - last time), least squares; `rms` of the residuals over all coordinates.
struct Line {
  Vector3d at_last;
  Vector3d slope;
  double rms;
};

Line fit_line(const std::vector<double>& times, const std::vector<Vector3d>& values) {
  const auto n = static_cast<double>(times.size());
  double mean_time = 0.0;
  Vector3d mean = Vector3d::Zero();
  for (std::size_t i = 0; i < times.size(); ++i) {
    mean_time += times[i] / n;
    mean += values[i] / n;
  }
  double spread = 0.0;
  Vector3d moment = Vector3d::Zero();
  for (std::size_t i = 0; i < times.size(); ++i) {
    spread += (times[i] - mean_time) * (times[i] - mean_time);
    moment += (times[i] - mean_time) * (values[i] - mean);
  }
  Line line;
  line.slope = moment / spread;
  line.at_last = mean + (times.back() - mean_time) * line.slope;
  double squares = 0.0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    squares += (values[i] - line.at_last - (times[i] - times.back()) * line.slope).squaredNorm();
  }
  line.rms = std::sqrt(squares / (3.0 * n));
  return line;
}

}  // namespace

core::Result<BallisticState> fit_ballistic(std::span<const TimedPose> poses, const Vector3d& center_of_mass,
                                           const Vector3d& gravity_W) {
  if (poses.size() < 3) return core::invalid_input("a ballistic fit takes at least three poses; give more frames");
  const TimedPose& last = poses.back();
  const TimedPose& middle = poses[poses.size() / 2];
  std::vector<double> times;
  std::vector<Vector3d> positions;
  std::vector<Vector3d> turns;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const TimedPose& pose = poses[i];
    if (i > 0 && !(pose.time > poses[i - 1].time)) return core::invalid_input("the poses' times do not ascend");
    const double t = pose.time - last.time;
    times.push_back(pose.time);
    positions.push_back(pose.X_WO * center_of_mass - 0.5 * t * t * gravity_W);
    turns.push_back(geometry::log_rotation(pose.X_WO.rotation * middle.X_WO.rotation.conjugate()));
    if (turns.back().norm() > 0.5 * std::numbers::pi) {
      return core::invalid_input("the object turns too far between the poses; give frames closer together");
    }
  }
  const Line position = fit_line(times, positions);
  const Line rotation = fit_line(times, turns);

  BallisticState state;
  state.time = last.time;
  state.X_WO.rotation = geometry::exp_rotation(rotation.at_last) * middle.X_WO.rotation;
  const Vector3d arm = state.X_WO.rotation * center_of_mass;
  state.X_WO.translation = position.at_last - arm;
  state.V_WO.angular = rotation.slope;
  state.V_WO.linear = position.slope - rotation.slope.cross(arm);
  state.position_rms = position.rms;
  state.rotation_rms = rotation.rms;
  return state;
}

}  // namespace prescene::simulation
