// SPDX-License-Identifier: Apache-2.0
// Are the poses that one frame leaves possible as many as it says? On simulated frames the truth is known: a region of
// 90 % should hold it in 90 % of frames. Two kinds of region: of highest density, by weighted samples of
// prior * exp(alpha * log ratio), and the ellipsoid of the Gauss-Newton information.
//
//   const CredibleRegionOptions options;
//   PRESCENE_TRY(const std::vector<FramePosterior> frames, frame_posteriors(options, seed, threads));
//   ... coverage(frames, options.factors).rows
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/service/evaluate/importance_sampling.h"

namespace prescene::service {

struct CredibleRegionOptions {
  int frames = 480;                                 ///< For each width; objects and distances take turns.
  std::vector<int> widths = {80, 160};              ///< Pixels across at which the likelihood looks.
  std::vector<double> distances = {0.6, 0.9, 1.3};  ///< m
  rendering::TemperingOptions tempering;
  rendering::SensorModelOptions sensor;
  rendering::SimulatedCameraOptions camera;
  /// What is known before: a Gaussian about a pose that is off by its spread. Weights are tried on a wide one ...
  double prior_turn = 0.15;    ///< rad per axis
  double prior_shift = 0.015;  ///< m per axis
  /// ... and Gauss-Newton information on a tracker's prediction, since it only holds nearby.
  double prediction_turn = 0.05;
  double prediction_shift = 0.005;
  ImportanceOptions sampling;
  /// Factors on the tempering at which everything is measured; 1 must be among them.
  std::vector<double> factors = {1.0};
};

/// One frame at one width.
struct FramePosterior {
  int object = 0;         ///< Index into tabletop_objects().
  double distance = 0.0;  ///< m
  int width = 0;
  int step = 1;         ///< Full-image pixels between two sampled ones.
  double pixels = 0.0;  ///< Measured on the object at the true pose.
  /// Per factor: the mass of the posterior that is denser than the truth; the truth lies in the 90 % region when this
  /// is at most 0.9.
  std::vector<double> mass_above_truth;
  /// Per factor: the share of a Gaussian nearer to its mean than the truth is, by the Gauss-Newton information.
  std::vector<double> ellipsoid_mass;
  std::vector<double> effective_samples;  ///< Per factor.
  double position_spread = 0.0;           ///< m, root of the posterior's mean squared error of position, factor 1.
};

struct CoverageRow {
  std::string group;  ///< "all", "80 px", "0.6 m", "carton", ...
  int n = 0;
  double pixels = 0.0;             ///< Mean.
  std::vector<double> weights_90;  ///< Per factor: share of frames whose 90 % region holds the truth ...
  std::vector<double> weights_50;
  std::vector<double> information_90;  ///< ... and the same of the ellipsoids.
  std::vector<double> information_50;
};

struct CredibleRegionReport {
  std::vector<double> factors;
  std::vector<CoverageRow> rows;
  double fewest_effective_samples = 0.0;
};

/// The frames one by one. Frames that show less than 5 measured pixels of the object at the smallest width are left
/// out. kCancelled when stopped.
core::Result<std::vector<FramePosterior>> frame_posteriors(const CredibleRegionOptions& options, std::uint64_t seed,
                                                           core::ThreadPool& threads,
                                                           const core::ProgressSink& progress = {},
                                                           const core::Cancellation* cancellation = nullptr);

/// Shares over all frames, by width, by distance, by object and by the number of pixels.
CredibleRegionReport coverage(const std::vector<FramePosterior>& frames, const std::vector<double>& factors);

nlohmann::ordered_json to_json(const CredibleRegionReport& report);

}  // namespace prescene::service
