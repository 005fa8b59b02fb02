// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/held_out_scatter.h"

#include <cmath>

namespace prescene::service {
namespace {

constexpr double kWidest = 4.0;
constexpr int kScatterHalvings = 5;
// Of the recordings while the factor is looked for; the scores are of a forecast's usual number.
constexpr int kScatterSamples = 32;

/// How much more the wide regions hold than they promise.
double excess_of(const TossScores& scores) {
  double sum = 0.0;
  int levels = 0;
  for (const CoverageValue& each : scores.coverage) {
    if (each.level < 0.75) continue;
    sum += each.held.value - each.level;
    ++levels;
  }
  return sum / levels;
}

simulation::ThrowScatter times(double factor, const simulation::ThrowScatter& scatter) {
  return {factor * scatter.position, factor * scatter.rotation, factor * scatter.friction};
}

}  // namespace

core::Result<std::vector<ScoredToss>> score_held_out(const std::vector<HeldOutMotion>& motions,
                                                     const std::vector<belief::Scene>& scenes,
                                                     const simulation::ThrowScatter& scatter, Backends& backends,
                                                     const core::RandomStream& stream,
                                                     const simulation::ForecastOptions& options,
                                                     const core::ProgressSink& progress,
                                                     const core::Cancellation* cancellation) {
  std::vector<std::optional<ScoredToss>> scored(motions.size());
  std::size_t done = 0;
  for (std::size_t scene = 0; scene < scenes.size(); ++scene) {
    std::vector<simulation::RecordedMotion> together;
    std::vector<std::size_t> numbers, places;
    for (std::size_t i = 0; i < motions.size(); ++i) {
      if (motions[i].scene != scene) continue;
      together.push_back(motions[i].motion);
      numbers.push_back(motions[i].number);
      places.push_back(i);
    }
    if (together.empty()) continue;
    const auto report = [&](const core::Progress& now) {
      if (progress)
        progress({(static_cast<double>(done) + now.fraction * static_cast<double>(together.size())) /
                      static_cast<double>(motions.size()),
                  std::nullopt, now.text});
    };
    PRESCENE_TRY(const std::vector<simulation::MotionForecast> forecasts,
                 simulation::forecast_motions(together, numbers, scenes[scene], scatter, backends.simulator_factory(),
                                              stream, backends.pool(), options, report, cancellation));
    const belief::ObjectModel& model = scenes[scene].model_of(scenes[scene].objects[0]);
    const double gyration = std::sqrt(0.5 * model.unit_inertia.trace());
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (forecasts[i].ends.empty()) continue;
      const HeldOutMotion& held_out = motions[places[i]];
      ScoredToss toss = score_toss(held_out.motion, held_out.rest, forecasts[i], gyration);
      toss.group = held_out.group;
      scored[places[i]] = std::move(toss);
    }
    done += together.size();
  }
  std::vector<ScoredToss> all;
  for (std::optional<ScoredToss>& each : scored)
    if (each) all.push_back(*std::move(each));
  return all;
}

core::Result<std::optional<HeldOutScatter>> held_out_scatter(const std::vector<HeldOutMotion>& motions,
                                                             const std::vector<belief::Scene>& scenes,
                                                             const simulation::ThrowScatter& fitted, Backends& backends,
                                                             const core::RandomStream& stream,
                                                             const core::ProgressSink& progress,
                                                             const core::Cancellation* cancellation) {
  if (motions.size() < kLeastHeldOut) return std::optional<HeldOutScatter>();
  const auto scores_with = [&](double factor, int samples) -> core::Result<std::optional<TossScores>> {
    simulation::ForecastOptions options;
    options.samples = samples;
    PRESCENE_TRY(const std::vector<ScoredToss> tosses,
                 score_held_out(motions, scenes, times(factor, fitted), backends, stream, options, {}, cancellation));
    if (tosses.size() < kLeastHeldOut) return std::optional<TossScores>();
    return std::optional<TossScores>(scores_of(tosses, stream.at(0, 2)));
  };
  double low = -std::log(kWidest), high = std::log(kWidest);
  for (int halving = 0; halving < kScatterHalvings; ++halving) {
    const double middle = 0.5 * (low + high);
    PRESCENE_TRY(const std::optional<TossScores> scores, scores_with(std::exp(middle), kScatterSamples));
    if (!scores) return std::optional<HeldOutScatter>();
    (excess_of(*scores) >= 0.0 ? high : low) = middle;
    if (progress)
      progress({static_cast<double>(halving + 1) / (kScatterHalvings + 1), std::nullopt, "held-out recordings"});
  }
  HeldOutScatter found;
  // The upper end: regions hold at least what they promise there.
  found.factor = std::exp(high);
  found.scatter = times(found.factor, fitted);
  PRESCENE_TRY(const std::optional<TossScores> scores,
               scores_with(found.factor, simulation::ForecastOptions{}.samples));
  if (!scores) return std::optional<HeldOutScatter>();
  found.scores = *scores;
  return std::optional<HeldOutScatter>(found);
}

}  // namespace prescene::service
