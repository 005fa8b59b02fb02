// SPDX-License-Identifier: Apache-2.0
// The recordings of a data set as calibration and evaluation take them: where each begins and rests, which are twins,
// and what is odd about them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/service/backends.h"
#include "prescene/service/calibration/object_calibration.h"
#include "prescene/simulation/calibration/flight_calibration.h"
#include "prescene/simulation/calibration/motion_calibration.h"
#include "prescene/simulation/calibration/recording_checks.h"

namespace prescene::service {

/// Flights that it takes to fit them alone.
inline constexpr std::size_t kLeastFlights = 3;

struct UsableMotions {
  std::vector<simulation::RecordedMotion> motions;  ///< Cut where something touched the object after its rest.
  std::vector<std::size_t> numbers;                 ///< Places in the data set.
  std::vector<std::optional<simulation::RecordedRest>> rests;
  std::vector<std::size_t> groups;   ///< Of each motion the place of its first twin; its own where it has none before.
  std::vector<std::string> remarks;  ///< What was touched, is a twin, or is left out.

  std::size_t independent() const;  ///< Motions of which none is another's twin.
  /// Those at `places` (ascending), without remarks.
  UsableMotions subset(const std::vector<std::size_t>& places) const;
  UsableMotions without_twins() const;
  /// Those that come to rest, each with the scene that `scene_of` gives its motion; below 0: left out.
  std::vector<HeldOutMotion> held_out(const std::vector<int>& scene_of) const;
};
/// What cannot be used is left out with a remark, unless more than a quarter is, or fewer than `least` remain that are
/// no twins: then kInvalidInput names the first three reasons.
core::Result<UsableMotions> usable_motions(const MotionDataset& dataset, std::size_t least, Backends& backends);

/// A fold for each motion, 0 to folds - 1, of equal sizes as far as twins, which share one, allow.
std::vector<int> folds_of(const std::vector<std::size_t>& groups, int folds, core::RandomStream stream);

core::Result<simulation::FlightCalibration> fly(const std::vector<simulation::RecordedMotion>& motions,
                                                const simulation::FlightPrior& prior);
simulation::FlightPrior flight_prior(const belief::Scene& scene, const simulation::MotionPrior& prior);
/// By how flights fall before they touch anything, whatever the fit of the model makes of it: kInvalidInput where it
/// is not the scene's gravity.
core::Status check_gravity(const MotionDataset& dataset, const std::vector<simulation::RecordedMotion>& motions);
/// Noise of the tracker, from slides where there are no flights.
core::Status measure_noise(const std::vector<simulation::RecordedMotion>& motions,
                           simulation::MotionCalibrationOptions* options);

/// As calibrate_object(), of recordings that are made ready.
core::Result<ObjectCalibration> calibrate_usable(const MotionDataset& dataset, const UsableMotions& all,
                                                 Backends& backends, const ObjectCalibrationOptions& options,
                                                 const core::ProgressSink& progress = {},
                                                 const core::Cancellation* cancellation = nullptr);

}  // namespace prescene::service
