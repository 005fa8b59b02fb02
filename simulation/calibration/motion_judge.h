// SPDX-License-Identifier: Apache-2.0
// How well simulations under a hypothesis forecast recorded motions.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "prescene/simulation/calibration/m_estimate.h"
#include "prescene/simulation/calibration/motion_calibration.h"

namespace prescene::simulation {

/// All that is varied.
struct MotionHypothesis {
  std::array<double, kMotionParameters> values{};
  double start_noise = 1.0;
  double friction_scatter = 0.0;

  double operator[](MotionParameter parameter) const { return values[static_cast<std::size_t>(parameter)]; }
  geometry::Vector3d center_of_mass() const {
    return {(*this)[MotionParameter::kCenterOfMassX], (*this)[MotionParameter::kCenterOfMassY],
            (*this)[MotionParameter::kCenterOfMassZ]};
  }
};

double radius_of_gyration(const belief::ObjectModel& model);

/// Keeps references to all it is given.
class MotionJudge {
 public:
  MotionJudge(const belief::Scene& scene, const SimulatorFactory& make_simulator, const core::RandomStream& stream,
              core::ThreadPool& pool, const MotionCalibrationOptions& options, const core::Cancellation* cancellation);

  /// Fails with kInvalidInput, naming the recording, where it cannot be used.
  core::Status add(const RecordedMotion& motion);
  /// Poses at the checkpoints, one view each, as places in a space where distances are those of calibrate_motions().
  const Observations& observations() const { return observations_; }
  /// Simulated ones under a hypothesis. The same random numbers in each call.
  core::Result<Eigen::MatrixXd> simulated(const MotionHypothesis& hypothesis) const;

 private:
  /// A recording made ready: the frames that starts are fitted to, and what came then.
  struct Case {
    std::span<const TimedPose> beginning;
    bool slides = false;
    std::size_t views = 0;  ///< Checkpoints that it lasts for.
  };

  std::size_t samples() const { return static_cast<std::size_t>(options_.samples); }
  double checkpoint_step() const { return options_.horizon / options_.checkpoints; }
  core::Status add_starts(std::size_t i, const MotionHypothesis& hypothesis,
                          std::vector<belief::WorldState>* starts) const;

  const belief::Scene& scene_;
  std::size_t model_;
  double gyration_;
  const SimulatorFactory& make_simulator_;
  const core::RandomStream& stream_;
  core::ThreadPool& pool_;
  const MotionCalibrationOptions& options_;
  const core::Cancellation* cancellation_;
  std::vector<Case> cases_;
  Observations observations_;
};

}  // namespace prescene::simulation
