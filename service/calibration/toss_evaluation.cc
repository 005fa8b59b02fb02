// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/calibration/toss_evaluation.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "prescene/core/text.h"
#include "prescene/interfaces/scene_files/model_file.h"
#include "prescene/service/calibration/motion_units.h"
#include "usable_motions.h"

namespace prescene::service {
namespace {

// Of random numbers: parts, forecasts and the resampling of scores.
constexpr std::uint32_t kPartDraws = 5;
constexpr std::uint32_t kForecastDraws = 6;
constexpr std::uint32_t kScoreDraws = 7;

core::Result<UsableMotions> scorable_motions(const MotionDataset& dataset, Backends& backends) {
  if (core::Status status = check_units(dataset.recordings, dataset.scene->gravity_W.norm()); !status.ok())
    return status.at(dataset.table_file().string());
  PRESCENE_TRY(UsableMotions usable, usable_motions(dataset, 1, backends));
  PRESCENE_RETURN_IF_ERROR(check_gravity(dataset, usable.motions));
  const auto resting = std::ranges::count_if(usable.rests, [](const auto& rest) { return rest.has_value(); });
  if (resting == 0) {
    return core::invalid_input(dataset.table_file().string() +
                               ": no recording comes to rest, so there is nothing to score: record until the object "
                               "has lain still for a tenth of a second");
  }
  for (std::size_t i = 0; i < usable.motions.size(); ++i) {
    if (!usable.rests[i]) usable.remarks.push_back(usable.motions[i].name + " does not come to rest and is not scored");
  }
  return usable;
}

/// Scores, and what they do not say.
core::Status finish(const MotionDataset& dataset, std::size_t motions, const core::RandomStream& stream,
                    TossEvaluation* found) {
  if (found->tosses.size() < motions) {
    found->remarks.push_back(std::to_string(motions - found->tosses.size()) +
                             " recordings are not scored: all of their simulated throws left the world; check where "
                             "the supports end");
  }
  if (found->tosses.empty())
    return core::invalid_input(dataset.table_file().string() + ": all simulated throws left the world");
  found->scores = scores_of(found->tosses, stream.at(0, kScoreDraws));
  if (found->scores.independent < 2)
    found->remarks.emplace_back(
        "one motion alone is scored: how far chance moves its scores is not known, and their standard errors are 0; "
        "record more");
  int moving = 0, lost = 0;
  for (const ScoredToss& toss : found->tosses) {
    moving += toss.moving;
    lost += toss.lost;
  }
  if (moving > 0)
    found->remarks.push_back(std::to_string(moving) +
                             " simulated throws still moved when their time ended; their last poses are scored");
  if (lost > 0) found->remarks.push_back(std::to_string(lost) + " simulated throws left the world and are not counted");
  return core::ok_status();
}

}  // namespace

core::Result<TossEvaluation> evaluate_model(const MotionDataset& dataset, const std::filesystem::path& model,
                                            Backends& backends, std::uint64_t seed, const core::ProgressSink& progress,
                                            const core::Cancellation* cancellation) {
  MotionDataset with = dataset;
  std::optional<interfaces::ModelThrows> throws;
  if (!model.empty()) {
    belief::Scene scene = *dataset.scene;
    belief::ObjectModel& own = scene.models[static_cast<std::size_t>(scene.objects[0].model)];
    PRESCENE_TRY(own, interfaces::read_model(model, own.name, {}, nullptr, &throws));
    with.scene = std::make_shared<const belief::Scene>(std::move(scene));
  }
  PRESCENE_TRY(const UsableMotions usable, scorable_motions(with, backends));
  TossEvaluation found;
  found.remarks = usable.remarks;
  belief::Scene scene = *with.scene;
  simulation::MotionCalibrationOptions noise;
  const std::vector<simulation::RecordedMotion> own = usable.without_twins().motions;
  if (const auto flights =
          std::ranges::count(own, simulation::MotionBeginning::kFlight, &simulation::RecordedMotion::beginning);
      flights >= static_cast<std::ptrdiff_t>(kLeastFlights)) {
    const simulation::MotionPrior prior = simulation::motion_prior(scene.model_of(scene.objects[0]));
    PRESCENE_TRY(const simulation::FlightCalibration flight, fly(own, flight_prior(scene, prior)));
    scene.gravity_W = flight.gravity_W;
    noise.position_noise = flight.position_noise;
    noise.rotation_noise = flight.rotation_noise;
  } else {
    PRESCENE_RETURN_IF_ERROR(measure_noise(usable.motions, &noise));
  }
  if (throws) {
    found.throws = {throws->position_noise, throws->rotation_noise, throws->friction_scatter};
  } else {
    found.throws = {noise.position_noise, noise.rotation_noise, 0.0};
    found.remarks.push_back(
        "the model says nothing of how throws differ (the key 'throws', which prescene calibrate writes): starts are "
        "taken to be as certain as the tracker's noise, " +
        core::fixed_text(1e3 * noise.position_noise, 2) + " mm and " + core::fixed_text(1e3 * noise.rotation_noise, 2) +
        " mrad, and regions may be too narrow");
  }
  const core::RandomStream stream(seed, core::Purpose::kEvaluation);
  const std::vector<HeldOutMotion> motions = usable.held_out(std::vector<int>(usable.motions.size(), 0));
  PRESCENE_TRY(found.tosses, score_held_out(motions, {scene}, found.throws, backends, stream.at(0, kForecastDraws), {},
                                            progress, cancellation));
  PRESCENE_RETURN_IF_ERROR(finish(dataset, motions.size(), stream, &found));
  return found;
}

core::Result<TossEvaluation> evaluate_folds(const MotionDataset& dataset, int folds, Backends& backends,
                                            const ObjectCalibrationOptions& options, const core::ProgressSink& progress,
                                            const core::Cancellation* cancellation) {
  PRESCENE_TRY(const UsableMotions usable, scorable_motions(dataset, backends));
  if (folds < 2 || static_cast<std::size_t>(folds) > usable.independent()) {
    return core::invalid_input("there are " + std::to_string(usable.independent()) +
                               " recordings that are no twins; give --folds a number from 2 to that many");
  }
  TossEvaluation found;
  found.remarks = usable.remarks;
  const core::RandomStream stream(options.seed, core::Purpose::kEvaluation);
  const std::vector<int> fold_of = folds_of(usable.groups, folds, stream.at(0, kPartDraws));
  std::vector<std::optional<ScoredToss>> scored(dataset.recordings.size());
  std::size_t resting = 0;
  for (int fold = 0; fold < folds; ++fold) {
    std::vector<std::size_t> others;
    std::vector<int> scene_of;  // the only one, of those of this part
    for (std::size_t i = 0; i < fold_of.size(); ++i) {
      if (fold_of[i] != fold) others.push_back(i);
      scene_of.push_back(fold_of[i] == fold ? 0 : -1);
    }
    const auto report = [&](const core::Progress& now) {
      if (progress)
        progress({(fold + now.fraction) / folds, std::nullopt,
                  "part " + std::to_string(fold + 1) + " of " + std::to_string(folds) + ": " + now.text});
    };
    const UsableMotions rest = usable.subset(others);
    auto calibration = calibrate_usable(dataset, rest, backends, options, report, cancellation);
    if (!calibration)
      return calibration.status().at("without part " + std::to_string(fold + 1) + " of " + std::to_string(folds));
    belief::Scene scene = *dataset.scene;
    scene.models[static_cast<std::size_t>(scene.objects[0].model)] = calibration->model;
    if (calibration->flight) scene.gravity_W = calibration->flight->gravity_W;
    const std::vector<HeldOutMotion> motions = usable.held_out(scene_of);
    resting += motions.size();
    PRESCENE_TRY(std::vector<ScoredToss> tosses, score_held_out(motions, {scene}, calibration->throws, backends,
                                                                stream.at(0, kForecastDraws), {}, {}, cancellation));
    for (ScoredToss& toss : tosses) {
      toss.fold = fold + 1;
      const auto at = std::ranges::find(dataset.recordings, toss.name, &MotionRecording::name);
      scored[static_cast<std::size_t>(at - dataset.recordings.begin())] = std::move(toss);
    }
    if (!calibration->motion.settled())
      found.remarks.push_back("the calibration without part " + std::to_string(fold + 1) +
                              " did not settle: its values may be wrong");
    found.folds.push_back(
        {calibration->flights + calibration->slides, static_cast<int>(motions.size()), *std::move(calibration)});
  }
  for (std::optional<ScoredToss>& toss : scored)
    if (toss) found.tosses.push_back(*std::move(toss));
  PRESCENE_RETURN_IF_ERROR(finish(dataset, resting, stream, &found));
  return found;
}

nlohmann::ordered_json to_json(const TossEvaluation& evaluation) {
  nlohmann::ordered_json json;
  json["scores"] = to_json(evaluation.scores);
  if (evaluation.folds.empty()) {
    json["throws"] = {{"position_noise", evaluation.throws.position},
                      {"rotation_noise", evaluation.throws.rotation},
                      {"friction_scatter", evaluation.throws.friction}};
  }
  for (const EvaluatedFold& fold : evaluation.folds) {
    nlohmann::ordered_json one = {{"fitted", fold.fitted}, {"scored", fold.scored}};
    one["calibration"] = to_json(fold.calibration);
    json["folds"].push_back(std::move(one));
  }
  json["tosses"] = nlohmann::ordered_json::array();
  for (const ScoredToss& toss : evaluation.tosses) json["tosses"].push_back(to_json(toss));
  json["remarks"] = evaluation.remarks;
  return json;
}

}  // namespace prescene::service
