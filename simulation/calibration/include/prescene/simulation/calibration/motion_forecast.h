// SPDX-License-Identifier: Apache-2.0
// Where recorded motions are forecast to end: each is simulated from what its first frames show until it rests.
//
//   PRESCENE_TRY(const std::vector<MotionForecast> forecasts,
//                forecast_motions(motions, numbers, scene, scatter, make_simulator, stream, pool));
//   ... forecasts[0].ends
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/core/progress.h"
#include "prescene/core/random.h"
#include "prescene/simulation/calibration/motion_calibration.h"

namespace prescene::simulation {

/// How throws of one object differ from each other beyond what is known of them. Starts are as uncertain as if a
/// tracker with this noise of a coordinate had seen them: it stands for all that the simulator does not model.
struct ThrowScatter {
  double position = 0.0;  ///< m, of each coordinate of a frame, >= 0.
  double rotation = 0.0;  ///< rad, about each axis, >= 0.
  double friction = 0.0;  ///< Standard deviation of the logarithm of both frictions together, >= 0.

  friend bool operator==(const ThrowScatter&, const ThrowScatter&) = default;
};

struct ForecastOptions {
  int samples = 64;       ///< Simulated starts a recording, > 0.
  double duration = 5.0;  ///< s, at most, > 0.
  int fit_frames = 10;    ///< Most of the beginning that the start is fitted to, >= 5.
};

struct MotionForecast {
  std::vector<geometry::Pose> ends;  ///< X_WO, one a sample; none has left the world or diverged.
  int moving = 0;                    ///< Samples that still moved after the duration: their last pose counts.
  int lost = 0;                      ///< Samples that left the world or diverged, which are not in `ends`.
};

/// One forecast for each of `motions`, which are used up to the end of their beginning only. `numbers[i]` chooses the
/// random numbers of motion i, so that these are the same whichever others are forecast with it. The model's uncertain
/// parameters are drawn from the scene. The same bits for any number of threads. Fails with kInvalidInput, naming the
/// recording, where its beginning cannot be used, as the factory does, and with kCancelled when stopped.
core::Result<std::vector<MotionForecast>> forecast_motions(
    std::span<const RecordedMotion> motions, std::span<const std::size_t> numbers, const belief::Scene& scene,
    const ThrowScatter& scatter, const SimulatorFactory& make_simulator, const core::RandomStream& stream,
    core::ThreadPool& pool, const ForecastOptions& options = {}, const core::ProgressSink& progress = {},
    const core::Cancellation* cancellation = nullptr);

}  // namespace prescene::simulation
