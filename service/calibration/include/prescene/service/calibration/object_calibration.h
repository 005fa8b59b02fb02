// SPDX-License-Identifier: Apache-2.0
// Fits the model of an object to recorded motions of it: free flight first, which needs no simulator, then all of it.
//
//   PRESCENE_TRY(const MotionDataset dataset, read_motion_dataset(folder, log));
//   PRESCENE_TRY(const ObjectCalibration found, calibrate_object(dataset, backends, {}));
//   PRESCENE_TRY(const std::string yaml, calibrated_yaml(dataset, found, path.parent_path()));
//   PRESCENE_RETURN_IF_ERROR(interfaces::write_file(path, yaml));
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/interfaces/scene_files/learned_file.h"
#include "prescene/service/backends.h"
#include "prescene/service/calibration/held_out_scatter.h"
#include "prescene/service/calibration/motion_dataset.h"
#include "prescene/simulation/calibration/flight_calibration.h"
#include "prescene/simulation/calibration/motion_calibration.h"

namespace prescene::service {

struct ObjectCalibrationOptions {
  std::uint64_t seed = 1;
  int max_evaluations = 1500;  ///< Of the search, > 0.
  /// Simulated starts a recording, > 1. 0: 16, of more than 125 recordings fewer, 8 at least: all of them together show
  /// as much.
  int samples = 0;
  std::vector<std::string> keep;  ///< Names of parameters that stay as the model has them.
};

struct ObjectCalibration {
  int flights = 0;  ///< Recordings that begin in flight.
  int slides = 0;   ///< That begin on a support.
  std::optional<simulation::FlightCalibration> flight;
  double position_noise = 0.0;           ///< Of a recorded coordinate, m, as flights or slides show it.
  double rotation_noise = 0.0;           ///< rad
  simulation::MotionPrior prior;         ///< Before any recording.
  simulation::MotionCalibration motion;  ///< left_of_prior is of that prior, after flights and contacts.
  belief::ObjectModel model;             ///< With the values as means and the errors as deviations.
  simulation::ThrowScatter throws;       ///< By held-out recordings, or where too few come to rest by the fit.
  std::optional<HeldOutScatter> held_out;
  std::vector<std::string> remarks;  ///< Plain sentences: what the recordings do not show, and what is odd.
};

/// Parameters by all recordings (but of twins one each), and how throws differ by recordings that parameters were not
/// fitted to: five parts of the recordings, each forecast with the parameters that the others have.
core::Result<ObjectCalibration> calibrate_object(const MotionDataset& dataset, Backends& backends,
                                                 const ObjectCalibrationOptions& options,
                                                 const core::ProgressSink& progress = {},
                                                 const core::Cancellation* cancellation = nullptr);

/// A model file that stands in `folder`: the model as the data set's scene describes it, with what was found.
core::Result<std::string> calibrated_yaml(const MotionDataset& dataset, const ObjectCalibration& found,
                                          const std::filesystem::path& folder);

/// A learned file with what was found in place of what `earlier` says of the model, and without what it says of the
/// data set's object, which was learned from other priors.
interfaces::LearnedFile with_calibrated(interfaces::LearnedFile earlier, const MotionDataset& dataset,
                                        const ObjectCalibration& found);

/// {"recordings", "flights", "slides", "evaluations", "settled", "score", "start_noise", "friction_scatter", "throws",
/// "held_out", "flight", "parameters", "remarks"}
nlohmann::ordered_json to_json(const ObjectCalibration& found);

}  // namespace prescene::service
