// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/sliding_fit.h"

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <vector>

#include "prescene/geometry/dense_solvers.h"

namespace prescene::simulation {
namespace {

using geometry::Vector3d;

/// Value and slope at time 0, the last pose's.
struct End {
  Vector3d value;
  Vector3d slope;
  Vector3d direction;
  double rms;
};

/// Rows of `values` at `times`: a parabola along the mean slope, straight lines across it.
End fit_end(const Eigen::VectorXd& times, const Eigen::MatrixX3d& values) {
  Eigen::MatrixX3d powers(times.size(), 3);
  powers << Eigen::VectorXd::Ones(times.size()), times, times.cwiseAbs2();
  const Eigen::Matrix<double, 2, 3> line = geometry::solve_least_squares(powers.leftCols<2>(), values);
  End end{line.row(0).transpose(), line.row(1).transpose(), Vector3d::Zero(), 0.0};
  Eigen::MatrixX3d residuals = values - powers.leftCols<2>() * line;
  if (end.slope.norm() > 1e-12) {
    end.direction = end.slope.normalized();
    const Eigen::VectorXd along = values * end.direction;
    const Eigen::Vector3d parabola = geometry::solve_least_squares(powers, along);
    end.value += (parabola[0] - end.value.dot(end.direction)) * end.direction;
    end.slope += (parabola[1] - end.slope.dot(end.direction)) * end.direction;
    residuals += (along - powers * parabola - residuals * end.direction) * end.direction.transpose();
  }
  end.rms = std::sqrt(residuals.squaredNorm() / (3.0 * static_cast<double>(times.size())));
  return end;
}

}  // namespace

core::Result<SlidingState> fit_sliding(std::span<const TimedPose> poses) {
  if (poses.size() < 5) return core::invalid_input("a sliding fit takes at least five poses; give more frames");
  const TimedPose& last = poses.back();
  const TimedPose& middle = poses[poses.size() / 2];
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::VectorXd times(count);
  Eigen::MatrixX3d positions(count, 3);
  Eigen::MatrixX3d turns(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const TimedPose& pose = poses[static_cast<std::size_t>(i)];
    if (i > 0 && !(pose.time > poses[static_cast<std::size_t>(i - 1)].time))
      return core::invalid_input("the poses' times do not ascend");
    times[i] = pose.time - last.time;
    positions.row(i) = pose.X_WO.translation.transpose();
    const Vector3d turn = geometry::log_rotation(pose.X_WO.rotation * middle.X_WO.rotation.conjugate());
    if (turn.norm() > 0.5 * std::numbers::pi)
      return core::invalid_input("the object turns too far between the poses; give frames closer together");
    turns.row(i) = turn.transpose();
  }
  const End position = fit_end(times, positions);
  const End rotation = fit_end(times, turns);
  SlidingState result;
  result.state.time = last.time;
  result.state.X_WO.rotation = geometry::exp_rotation(rotation.value) * middle.X_WO.rotation;
  result.state.X_WO.translation = position.value;
  result.state.V_WO.angular = rotation.slope;
  result.state.V_WO.linear = position.slope;
  result.state.position_rms = position.rms;
  result.state.rotation_rms = rotation.rms;
  result.direction_W = position.direction;
  result.turn_axis_W = rotation.direction;
  return result;
}

}  // namespace prescene::simulation
