// SPDX-License-Identifier: Apache-2.0
#include "motion_starts.h"

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/geometry/dense_solvers.h"
#include "prescene/simulation/calibration/sliding_fit.h"

namespace prescene::simulation {
namespace {

using geometry::Vector3d;

/// Standard deviations of value and slope at the end of a polynomial that is fitted to n frames which are `step` apart,
/// for noise one.
struct EndErrors {
  double value;
  double slope;
};
EndErrors end_errors(std::size_t frames, double step, int degree) {
  const auto n = static_cast<Eigen::Index>(frames);
  Eigen::MatrixXd powers = Eigen::MatrixXd::Ones(n, degree + 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (int d = 1; d <= degree; ++d) powers(i, d) = powers(i, d - 1) * static_cast<double>(i + 1 - n);
  }
  const Eigen::MatrixXd covariance = geometry::inverse(geometry::product(powers.transpose(), powers));
  return {std::sqrt(covariance(0, 0)), std::sqrt(covariance(1, 1)) / step};
}

}  // namespace

core::Result<MotionStart> fit_motion_start(std::span<const TimedPose> frames, bool slides,
                                           const Vector3d& center_of_mass, const Vector3d& gravity_W) {
  const double step = (frames.back().time - frames.front().time) / static_cast<double>(frames.size() - 1);
  const EndErrors line = end_errors(frames.size(), step, 1);
  const geometry::Matrix3d all = geometry::Matrix3d::Identity();
  if (!slides) {
    PRESCENE_TRY(const BallisticState state, fit_ballistic(frames, center_of_mass, gravity_W));
    return MotionStart{state, line.value * all, line.value * all, line.slope * all, line.slope * all};
  }
  PRESCENE_TRY(const SlidingState sliding, fit_sliding(frames));
  const EndErrors parabola = end_errors(frames.size(), step, 2);
  const auto along = [&](const Vector3d& axis, double otherwise, double along_it) {
    return geometry::Matrix3d(otherwise * all + (along_it - otherwise) * axis * axis.transpose());
  };
  return MotionStart{sliding.state, along(sliding.direction_W, line.value, parabola.value),
                     along(sliding.turn_axis_W, line.value, parabola.value),
                     along(sliding.direction_W, line.slope, parabola.slope),
                     along(sliding.turn_axis_W, line.slope, parabola.slope)};
}

belief::ObjectState drawn_start(const MotionStart& start, const ThrowScatter& scatter,
                                const belief::PhysicalParameters& physical, std::span<const double> uniforms) {
  Eigen::Matrix<double, kStartDimensions, 1> z;
  for (int d = 0; d < kStartDimensions; ++d) z[d] = core::inverse_normal_cdf(uniforms[static_cast<std::size_t>(d)]);
  belief::ObjectState object;
  object.mode = belief::MotionMode::kMoving;
  object.X_WO = start.state.X_WO;
  object.X_WO.translation += scatter.position * start.place * z.head<3>();
  object.X_WO.rotation = geometry::exp_rotation(scatter.rotation * start.turn * z.segment<3>(3)) * object.X_WO.rotation;
  object.V_WO = start.state.V_WO;
  object.V_WO.linear += scatter.position * start.velocity * z.segment<3>(6);
  object.V_WO.angular += scatter.rotation * start.spin * z.segment<3>(9);
  const double factor = std::exp(scatter.friction * z[12]);
  object.physical = physical;
  object.physical.friction *= factor;
  object.physical.impact_friction *= factor;
  return object;
}

void land(const Simulator& simulator, std::span<const std::size_t> sliding, double seconds,
          const core::RandomStream& stream, core::ThreadPool& pool, std::span<belief::WorldState> starts,
          const core::Cancellation* cancellation) {
  if (sliding.empty()) return;
  std::vector<belief::WorldState> landing;
  for (const std::size_t i : sliding) {
    landing.push_back(starts[i]);
    landing.back().objects[0].physical.restitution = 0.0;
  }
  RunRequest request;
  request.stop.duration = seconds;
  std::vector<belief::Trajectory> runs(landing.size());
  simulator.run(landing, request, stream, 0, pool, runs, cancellation);
  if (cancellation != nullptr && cancellation->requested()) return;
  for (std::size_t k = 0; k < sliding.size(); ++k) {
    const belief::ObjectState& landed = runs[k].final().objects[0];
    belief::ObjectState& start = starts[sliding[k]].objects[0];
    start.X_WO = landed.X_WO;
    start.V_WO = landed.V_WO;
  }
}

}  // namespace prescene::simulation
