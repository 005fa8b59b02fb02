// SPDX-License-Identifier: Apache-2.0
// How well somebody's own recordings are forecast: by a given model, or each by a model that was fitted to the others.
//
//   PRESCENE_TRY(const MotionDataset dataset, read_motion_dataset(folder, log));
//   PRESCENE_TRY(const TossEvaluation found, evaluate_model(dataset, path, backends, {}));
//   ... found.scores.brier.value
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/service/calibration/object_calibration.h"

namespace prescene::service {

/// One part of the recordings, forecast by the model that the others have.
struct EvaluatedFold {
  int fitted = 0;  ///< Recordings that the model was fitted to.
  int scored = 0;
  ObjectCalibration calibration;
};

struct TossEvaluation {
  std::vector<ScoredToss> tosses;  ///< In the data set's order, those that come to rest.
  TossScores scores;
  simulation::ThrowScatter throws;   ///< Of evaluate_model().
  std::vector<EvaluatedFold> folds;  ///< Of evaluate_folds().
  std::vector<std::string> remarks;  ///< Twins, what was touched, what is left out, and what scores do not say.
};

/// Forecasts with the model of `model` (a model file; empty: the scene's own). A start is read off the frames before
/// the first contact, or the first ten of a slide. How throws differ is what the model file says (`throws`), else the
/// tracker's noise, with a remark. Gravity is the flights' own, in the tracker's metres, where there are three.
/// Fails with kInvalidInput where no recording can be scored (none comes to rest, millimetres, ...), and as reading the
/// model does.
core::Result<TossEvaluation> evaluate_model(const MotionDataset& dataset, const std::filesystem::path& model,
                                            Backends& backends, std::uint64_t seed,
                                            const core::ProgressSink& progress = {},
                                            const core::Cancellation* cancellation = nullptr);

/// The recordings in `folds` parts (>= 2), twins together, each forecast by what calibrate_object() makes of the
/// others, from the scene's model on.
core::Result<TossEvaluation> evaluate_folds(const MotionDataset& dataset, int folds, Backends& backends,
                                            const ObjectCalibrationOptions& options,
                                            const core::ProgressSink& progress = {},
                                            const core::Cancellation* cancellation = nullptr);

/// {"scores", "throws" or "folds", "tosses", "remarks"}
nlohmann::ordered_json to_json(const TossEvaluation& evaluation);

}  // namespace prescene::service
