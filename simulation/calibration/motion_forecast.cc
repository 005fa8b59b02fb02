// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/motion_forecast.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "motion_starts.h"
#include "prescene/belief/physical_belief.h"
#include "prescene/core/check.h"
#include "prescene/core/sobol.h"

namespace prescene::simulation {
namespace {

// Recordings that are simulated together: lockstep fills its lanes, and a stop is not waited for long.
constexpr std::size_t kTogether = 8;

core::Status check(const RecordedMotion& motion) {
  const std::size_t least = motion.beginning == MotionBeginning::kSlide ? 5 : 3;
  if (motion.first_frames >= least && motion.first_frames <= motion.frames.size()) return core::ok_status();
  return core::invalid_input(motion.name + ": its beginning has " + std::to_string(motion.first_frames) +
                             " frames; it takes " + std::to_string(least));
}

}  // namespace

core::Result<std::vector<MotionForecast>> forecast_motions(
    std::span<const RecordedMotion> motions, std::span<const std::size_t> numbers, const belief::Scene& scene,
    const ThrowScatter& scatter, const SimulatorFactory& make_simulator, const core::RandomStream& stream,
    core::ThreadPool& pool, const ForecastOptions& options, const core::ProgressSink& progress,
    const core::Cancellation* cancellation) {
  PRESCENE_CHECK(motions.size() == numbers.size() && scene.objects.size() == 1);
  if (options.samples < 1 || options.fit_frames < 5 || !(options.duration > 0.0) || !(scatter.position >= 0.0) ||
      !(scatter.rotation >= 0.0) || !(scatter.friction >= 0.0))
    return core::invalid_input("an option of the forecast is out of range");
  PRESCENE_TRY(const std::unique_ptr<Simulator> simulator, make_simulator(scene, 1.0));
  const belief::ObjectModel& model = scene.model_of(scene.objects[0]);
  const int physical = belief::physical_dimensions(model);
  const belief::WorldState mean = belief::mean_start(scene);
  const auto samples = static_cast<std::size_t>(options.samples);
  RunRequest request;
  request.stop.duration = options.duration;
  std::vector<MotionForecast> forecasts(motions.size());
  std::vector<double> uniform(static_cast<std::size_t>(kStartDimensions + physical));
  for (std::size_t first = 0; first < motions.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, motions.size() - first);
    std::vector<belief::WorldState> starts;
    std::vector<std::size_t> sliding;
    for (std::size_t i = first; i < first + count; ++i) {
      const RecordedMotion& motion = motions[i];
      PRESCENE_RETURN_IF_ERROR(check(motion));
      const std::size_t used = std::min(motion.first_frames, static_cast<std::size_t>(options.fit_frames));
      const auto begun = fit_motion_start(std::span(motion.frames).subspan(motion.first_frames - used, used),
                                          motion.beginning == MotionBeginning::kSlide,
                                          belief::mean(model.center_of_mass), scene.gravity_W);
      if (!begun) return begun.status().at(motion.name);
      core::RandomStream own = stream.at(numbers[i]);
      const core::SobolNet net(static_cast<int>(uniform.size()), own.next_u64());
      for (std::size_t k = 0; k < samples; ++k) {
        net.point(k, uniform);
        belief::WorldState start = mean;
        start.objects[0] =
            drawn_start(*begun, scatter, belief::physical_at(model, std::span(uniform).subspan(kStartDimensions)),
                        std::span(uniform).first(kStartDimensions));
        if (motion.beginning == MotionBeginning::kSlide) sliding.push_back(starts.size());
        starts.push_back(std::move(start));
      }
    }
    land(*simulator, sliding, kLanding, stream.at(numbers[first], 1), pool, starts, cancellation);
    std::vector<belief::Trajectory> runs(starts.size());
    simulator->run(starts, request, stream.at(numbers[first], 1), 0, pool, runs, cancellation);
    if (cancellation != nullptr && cancellation->requested())
      return core::cancelled("stopped after " + std::to_string(first) + " recordings");
    for (std::size_t run = 0; run < runs.size(); ++run) {
      MotionForecast& forecast = forecasts[first + run / samples];
      const belief::Trajectory& trajectory = runs[run];
      if (trajectory.end == belief::TrajectoryEnd::kLeftTheWorld ||
          trajectory.end == belief::TrajectoryEnd::kDiverged) {
        ++forecast.lost;
        continue;
      }
      if (trajectory.end != belief::TrajectoryEnd::kAtRest) ++forecast.moving;
      forecast.ends.push_back(trajectory.final().objects[0].X_WO);
    }
    if (progress) {
      const std::size_t done = first + count;
      progress({static_cast<double>(done) / static_cast<double>(motions.size()), std::nullopt,
                std::to_string(done) + " of " + std::to_string(motions.size()) + " recordings"});
    }
  }
  return forecasts;
}

}  // namespace prescene::simulation
