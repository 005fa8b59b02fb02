// SPDX-License-Identifier: Apache-2.0
// Fits the cube's model to recorded tosses.
#pragma once

#include <vector>

#include "prescene/service/evaluate/cube_tosses.h"

namespace prescene::service {

/// Read off the recordings themselves, without simulation.
struct CubeMeasurements {
  double half_edge = 0.0;  ///< m, median height of the middle at rest.
  double gravity = 0.0;    ///< m/s^2, pooled from the flights before contact.
  double gravity_standard_error = 0.0;
};
/// From tosses of at least eight frames before contact; `model` gives the centre of mass. Fails with kInvalidInput when
/// there is none.
core::Result<CubeMeasurements> measure_cube(const std::vector<CubeToss>& tosses, const CubeModel& model);

/// What is made small: mean Brier score of the face + kPlaceWeight times the mean energy score of the place.
inline constexpr double kPlaceWeight = 5.0;  // per m
double calibration_cost(const std::vector<CubeForecast>& forecasts);

struct CalibrationOptions {
  int samples = 24;           ///< Starts a toss, the same ones in each evaluation.
  int max_evaluations = 150;  ///< Of the cost, > 0.
};
struct CubeCalibration {
  CubeModel model;
  double start_cost = 0.0;  ///< With the lengths measured and all else as at the start.
  double cost = 0.0;
  int evaluations = 0;
  /// What the noise of the start was then multiplied by, so that regions hold what they promise.
  double widened = 1.0;
  bool stopped = false;  ///< By cancellation: `model` is the best so far.
};

/// Measures lengths, then searches frictions, restitution, inertia, rounding, centre of mass and the size of the
/// start's noise (its four parts keep their ratios) from `start` for a minimum of the cost. Scores of few samples like
/// little noise; it is therefore widened in the end, by tenths, until nine of ten tosses end inside their region of
/// mass 0.9. Fails with kCancelled when
/// stopped before the first evaluation was done.
core::Result<CubeCalibration> calibrate_cube(const std::vector<CubeToss>& tosses, CubeModel start, std::uint64_t seed,
                                             core::ThreadPool& threads, const core::ProgressSink& progress = {},
                                             const core::Cancellation* cancellation = nullptr,
                                             const CalibrationOptions& options = {});

}  // namespace prescene::service
