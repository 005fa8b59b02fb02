// SPDX-License-Identifier: Apache-2.0
// What recorded tosses, bounces and slides show of an object: frictions, restitution, inertia, rounding of edges and
// centre of mass, each with its standard error. Every recording is simulated from its beginning, while the object flies
// or slides freely, from several starts about what these frames say, and compared with what came then.
//
//   MotionPrior prior = motion_prior(scene.model_of(scene.objects[0]));
//   PRESCENE_TRY(const MotionCalibration found,
//                calibrate_motions(motions, scene, prior, make_simulator, stream, pool));
//   ... found.parameters[0].value, found.parameters[0].standard_error
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/random.h"
#include "prescene/simulation/calibration/ballistic_fit.h"
#include "prescene/simulation/calibration/m_estimate.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

enum class MotionBeginning {
  kFlight,  ///< Before the first contact: the centre of mass is on a parabola.
  kSlide,   ///< Released on a support: slower at a constant rate.
};

/// One recording of the scene's only object, that nothing touches but the supports.
struct RecordedMotion {
  std::string name;               ///< For messages.
  std::vector<TimedPose> frames;  ///< X_WO
  MotionBeginning beginning = MotionBeginning::kFlight;
  std::size_t first_frames = 0;  ///< That show the beginning and nothing else, >= 3 (flight) or >= 5 (slide).
};

enum class MotionParameter {
  kFriction,        ///< Of the object, while it slides.
  kImpactFriction,  ///< Of the object, in impacts.
  kRestitution,
  kInertiaSize,    ///< Natural logarithm of the factor of the unit inertia.
  kEdgeRadius,     ///< m
  kCenterOfMassX,  ///< m
  kCenterOfMassY,
  kCenterOfMassZ,
};
inline constexpr std::size_t kMotionParameters = 8;
/// "friction", "impact_friction", ...
std::string to_string(MotionParameter parameter);

/// What is believed of a parameter before: Gaussian. A deviation of zero keeps it as it is.
struct MotionBelief {
  double mean = 0.0;
  double deviation = 0.0;
};
using MotionPrior = std::array<MotionBelief, kMotionParameters>;  ///< By MotionParameter.
/// The model's own distributions where it has any; where it has none, as wide as everyday things differ: friction and
/// restitution by 0.2, inertia by 0.15, edges by 2 mm, the centre of mass by a tenth of the radius of gyration.
MotionPrior motion_prior(const belief::ObjectModel& model);

struct MotionCalibrationOptions {
  int samples = 16;              ///< Simulated starts a recording, > 1.
  int max_evaluations = 1500;    ///< Of the search, > 0; the estimate takes some 400 more.
  double horizon = 0.6;          ///< s after the start that are compared, at most, > 0.
  int checkpoints = 6;           ///< Times within the horizon, > 0.
  int fit_frames = 10;           ///< Most of the beginning that the start is fitted to, >= 5.
  double position_noise = 3e-4;  ///< Of a recorded pose's coordinate, m, > 0: see FlightCalibration.
  double rotation_noise = 2e-3;  ///< rad, > 0
  EstimateOptions estimate;
};

struct CalibratedParameter {
  MotionParameter parameter = MotionParameter::kFriction;
  double value = 0.0;  ///< Recordings and prior together.
  double standard_error = 0.0;
  /// Over the prior's deviation, at most 1: then the recordings say nothing about it; the value is the prior's mean.
  double left_of_prior = 1.0;
};
struct MotionCalibration {
  std::vector<CalibratedParameter> parameters;  ///< Those with a prior deviation, in the order of the enumeration.
  /// By how much starts are less certain than their fit says: stands for all that the simulator does not know.
  double start_noise = 1.0;
  double friction_scatter = 0.0;  ///< Relative, from recording to recording.
  /// For each fold of EstimateOptions::folds the parameters' values without its recordings, in their order.
  std::vector<std::vector<double>> without;
  double start_cost = 0.0;  ///< Mean score of the prior's means.
  double cost = 0.0;        ///< Of what was found.
  int evaluations = 0;
  bool search_settled = false;    ///< Else it ended at its evaluations, and the values may be wrong.
  bool estimate_settled = false;  ///< Else the errors may be too small.
  bool settled() const { return search_settled && estimate_settled; }
};
/// Of the centre of mass: no number of frames with this noise of a coordinate, m, determines it better.
double least_center_error(double position_noise);

/// Of what was known with the error `before`, and with the error `after` once more was seen: its error where both may
/// be off for the same reason, such as noise of frames that both use, instead of independently. Between `after` and
/// sqrt(2) times that. Takes 0 < after; returns `after` where it is not less than `before`.
double error_of_shared_frames(double before, double after);
/// A copy of the model with the values as means and the errors as deviations; what is unidentifiable stays as it is,
/// plain numbers with the prior's deviation.
belief::ObjectModel calibrated_model(belief::ObjectModel model, const MotionCalibration& found);

/// Least number of recordings for so many free parameters.
constexpr std::size_t least_recordings(std::size_t free_parameters) { return free_parameters + 3; }

/// Recordings that the search looks at, at most: it has to find the valley, and its cost grows with them.
inline constexpr std::size_t kSearchRecordings = 40;

/// Minimum of the mean kernel score of the poses at the checkpoints (see recording_scores()), in the metric
/// sqrt(|dp|^2 + (rg turn)^2) with the radius of gyration rg: an evolution strategy finds the valley, m_estimate() its
/// ground and the errors. Of 90 % intervals, value +- 1.645 errors, on simulated tosses see
/// docs/reference/calibration.md. Of many recordings the search looks at every so many only (see kSearchRecordings);
/// the estimate takes all. The scene has one object and no actions. The same bits for any number of threads. Fails with
/// kInvalidInput where the recordings cannot be used (named) and as the factory does, with kCancelled when stopped.
core::Result<MotionCalibration> calibrate_motions(const std::vector<RecordedMotion>& motions,
                                                  const belief::Scene& scene, const MotionPrior& prior,
                                                  const SimulatorFactory& make_simulator,
                                                  const core::RandomStream& stream, core::ThreadPool& pool,
                                                  const MotionCalibrationOptions& options = {},
                                                  const core::ProgressSink& progress = {},
                                                  const core::Cancellation* cancellation = nullptr);

}  // namespace prescene::simulation
