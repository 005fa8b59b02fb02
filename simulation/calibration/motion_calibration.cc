// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/motion_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "motion_judge.h"
#include "prescene/belief/validation.h"
#include "prescene/simulation/calibration/evolution_search.h"
#include "prescene/simulation/calibration/keep_prior.h"
#include "varied_parameters.h"

namespace prescene::simulation {
namespace {

using belief::ScalarDistribution;
using geometry::Vector3d;

// Of the search, in the parameters' steps: what comes then needs no better.
constexpr double kSearchAccuracy = 0.05;
// Nor does it need what less than so much, of the mean score, is gained by in so many evaluations a parameter: it
// differs by chance.
constexpr double kSearchGain = 0.1;
constexpr int kSearchPatience = 20;
// Shares of the search's evaluations that each of its starts, and then the better half of them, may take at most.
constexpr std::array kFieldShares = {1.0 / 16.0, 1.0 / 6.0};
// Particles of the stream; a recording's starts are drawn from particle 0.
constexpr std::uint32_t kSearchDraws = 1;
constexpr std::uint32_t kTrialDraws = 2;
// Of estimate and noise.
constexpr int kTurns = 2;
constexpr int kNoiseHalvings = 2;
constexpr int kNoiseEvaluations = 40;

// Of the friction from slides, beside its statistical error: by how much simulated slides of known friction were
// off. A third of it is half a step of the simulator, in which a sliding object's velocity lags behind its place.
constexpr double kSlideError = 0.04;
// Of the centre of mass, in the noise of a position: what frames of one tracker have in common, such as where it takes
// the object's frame to be, is not averaged out by any number of them.
constexpr double kCommonError = 0.1;
constexpr double kLeastCenterError = 1e-5;  // m
// Of a fitted model, as in scene files.
constexpr double kMostFriction = 100.0;

bool is_center(MotionParameter parameter) { return parameter >= MotionParameter::kCenterOfMassX; }

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

core::Status check(const std::vector<RecordedMotion>& motions, const belief::Scene& scene, const MotionPrior& prior,
                   const MotionCalibrationOptions& options) {
  if (scene.objects.size() != 1 || !scene.actions.empty() || scene.objects[0].held_by)
    return core::invalid_input("a calibration takes a scene with one object, held by nothing, and no actions");
  if (options.samples < 2 || options.max_evaluations < 1 || options.checkpoints < 1 || options.fit_frames < 5 ||
      !(options.horizon > 0.0) || !(options.position_noise > 0.0) || !(options.rotation_noise > 0.0))
    return core::invalid_input("an option of the calibration is out of range");
  std::size_t free = 0;
  for (const MotionBelief& belief : prior) {
    if (!std::isfinite(belief.mean) || !(belief.deviation >= 0.0) || !std::isfinite(belief.deviation))
      return core::invalid_input("a prior of the calibration is not finite, or its deviation is negative");
    free += belief.deviation > 0.0 ? 1 : 0;
  }
  if (free == 0) return core::invalid_input("no parameter of the calibration is free");
  if (motions.size() < least_recordings(free)) {
    return core::invalid_input("only " + std::to_string(motions.size()) + " recordings; " + std::to_string(free) +
                               " parameters take at least " + std::to_string(least_recordings(free)) +
                               ": record more, or keep parameters as they are (--keep)");
  }
  return core::ok_status();
}

/// Searches from several starts: each a little, the better half some more, the best to its end.
SearchResult search_from(std::vector<std::vector<SearchParameter>> starts, const EvolutionSearch::Cost& cost,
                         int max_evaluations, const core::RandomStream& stream, const SearchProgress& report) {
  const SearchEnd end{kSearchAccuracy, kSearchPatience * static_cast<int>(starts.front().size()), kSearchGain};
  std::vector<EvolutionSearch> field;
  for (std::vector<SearchParameter>& start : starts)
    field.emplace_back(std::move(start), end, stream.at(field.size(), kSearchDraws));
  const auto best_first = [&] {
    std::ranges::stable_sort(field, {}, [](const EvolutionSearch& search) { return search.best().cost; });
  };
  int tried = 0;
  for (const double share : kFieldShares) {
    if (field.size() == 1) break;
    const int most = std::max(1, static_cast<int>(share * max_evaluations));
    for (EvolutionSearch& search : field) {
      const int before = search.best().evaluations;
      search.run(cost, std::min(most, before + max_evaluations - tried), report);
      tried += search.best().evaluations - before;
    }
    std::erase_if(field, [](const EvolutionSearch& search) { return search.best().evaluations == 0; });
    best_first();
    field.erase(field.begin() + static_cast<std::ptrdiff_t>((field.size() + 1) / 2), field.end());
  }
  best_first();
  EvolutionSearch& best = field.front();
  best.run(cost, best.best().evaluations + max_evaluations - tried, report);
  return best.best();
}

/// What the recordings determine, and what they do not.
std::vector<CalibratedParameter> reported(const Estimate& estimate, const VariedParameters& varied,
                                          const MotionPrior& prior, double slide_share, double position_noise) {
  const auto n = static_cast<Eigen::Index>(varied.free().size());
  Eigen::VectorXd value = estimate.value;
  Eigen::MatrixXd covariance = estimate.covariance;
  Eigen::VectorXd mean(n);
  Eigen::VectorXd deviation(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t k = varied.free()[static_cast<std::size_t>(i)];
    mean[i] = prior[k].mean;
    deviation[i] = prior[k].deviation;
    double least = 0.0;
    if (static_cast<MotionParameter>(k) == MotionParameter::kFriction)
      covariance(i, i) += std::pow(kSlideError * slide_share * value[i], 2);
    if (is_center(static_cast<MotionParameter>(k))) least = least_center_error(position_noise);
    covariance(i, i) = std::max(covariance(i, i), least * least);
  }
  keep_prior(mean, deviation, &value, &covariance);
  std::vector<CalibratedParameter> all;
  const std::vector<EstimatedParameter> estimated = varied.estimated({});
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto place = static_cast<std::size_t>(i);
    const double error = std::sqrt(covariance(i, i));
    // What is determined hardly more than that may end beyond what can be.
    const bool unidentifiable = error >= kUnidentifiable * deviation[i];
    all.push_back({static_cast<MotionParameter>(varied.free()[place]),
                   unidentifiable ? value[i] : std::clamp(value[i], estimated[place].low, estimated[place].high), error,
                   error / deviation[i]});
  }
  return all;
}

/// Of each fold; what the recordings do not determine stays as all of them leave it.
std::vector<std::vector<double>> values_without(const Estimate& estimate, const VariedParameters& varied,
                                                const std::vector<CalibratedParameter>& reported_values) {
  const std::vector<EstimatedParameter> estimated = varied.estimated({});
  std::vector<std::vector<double>> all;
  for (const Eigen::VectorXd& without : estimate.without) {
    std::vector<double>& values = all.emplace_back();
    for (std::size_t i = 0; i < reported_values.size(); ++i) {
      const bool unidentifiable = reported_values[i].left_of_prior >= kUnidentifiable;
      values.push_back(unidentifiable
                           ? reported_values[i].value
                           : std::clamp(without[static_cast<Eigen::Index>(i)], estimated[i].low, estimated[i].high));
    }
  }
  return all;
}

/// Places of the recordings that the search looks at, evenly spread.
std::vector<std::size_t> searched(std::size_t count) {
  std::vector<std::size_t> places;
  const std::size_t most = std::min(count, kSearchRecordings);
  for (std::size_t i = 0; i < most; ++i) places.push_back(i * count / most);
  return places;
}

}  // namespace

double least_center_error(double position_noise) { return std::max(kCommonError * position_noise, kLeastCenterError); }

double error_of_shared_frames(double before, double after) {
  if (!(after < before)) return after;
  // Precisions add to 1 / after^2; errors 1 / sqrt(precision), weighted by precision, add as they are.
  const double first = 1.0 / (before * before);
  const double both = 1.0 / (after * after);
  return (std::sqrt(first) + std::sqrt(both - first)) / both;
}

std::string to_string(MotionParameter parameter) {
  static constexpr std::array<const char*, kMotionParameters> kNames = {
      "friction",    "impact_friction",  "restitution",      "inertia_size",
      "edge_radius", "center_of_mass_x", "center_of_mass_y", "center_of_mass_z"};
  return kNames[static_cast<std::size_t>(parameter)];
}

MotionPrior motion_prior(const belief::ObjectModel& model) {
  const double gyration = radius_of_gyration(model);
  const auto of = [](const ScalarDistribution& distribution, double otherwise) {
    const double deviation = std::sqrt(belief::variance(distribution));
    return MotionBelief{belief::mean(distribution), deviation > 0.0 ? deviation : otherwise};
  };
  MotionPrior prior;
  const auto set = [&](MotionParameter parameter, const MotionBelief& belief) {
    prior[static_cast<std::size_t>(parameter)] = belief;
  };
  set(MotionParameter::kFriction, of(model.contact.friction, 0.2));
  set(MotionParameter::kImpactFriction, of(model.contact.impact_friction.value_or(model.contact.friction), 0.2));
  set(MotionParameter::kRestitution, of(model.contact.restitution, 0.2));
  set(MotionParameter::kInertiaSize, {0.0, 0.15});
  set(MotionParameter::kEdgeRadius, {model.contact.edge_radius, 0.002});
  set(MotionParameter::kCenterOfMassX, of(model.center_of_mass.x, 0.1 * gyration));
  set(MotionParameter::kCenterOfMassY, of(model.center_of_mass.y, 0.1 * gyration));
  set(MotionParameter::kCenterOfMassZ, of(model.center_of_mass.z, 0.1 * gyration));
  return prior;
}

belief::ObjectModel calibrated_model(belief::ObjectModel model, const MotionCalibration& found) {
  const double infinity = std::numeric_limits<double>::infinity();
  const belief::ContactProperties before = model.contact;
  for (const CalibratedParameter& p : found.parameters) {
    const bool unidentifiable = p.left_of_prior >= kUnidentifiable;
    const auto fitted = [&](const ScalarDistribution& prior, double low, double high) {
      // A distribution about which nothing is said stays what it is, whatever its form.
      if (unidentifiable && belief::variance(prior) > 0.0) return prior;
      return ScalarDistribution(belief::NormalScalar{p.value, p.standard_error, low, high});
    };
    switch (p.parameter) {
      case MotionParameter::kFriction:
        model.contact.friction = fitted(before.friction, 0.0, kMostFriction);
        break;
      case MotionParameter::kImpactFriction:
        model.contact.impact_friction = fitted(before.impact_friction.value_or(before.friction), 0.0, kMostFriction);
        break;
      case MotionParameter::kRestitution:
        model.contact.restitution = fitted(before.restitution, 0.0, 1.0);
        break;
      case MotionParameter::kInertiaSize:
        if (!unidentifiable) model.unit_inertia *= std::exp(p.value);
        break;
      case MotionParameter::kEdgeRadius:
        if (!unidentifiable)
          model.contact.edge_radius = std::clamp(p.value, 0.0, belief::thinnest_half(model.collision));
        break;
      case MotionParameter::kCenterOfMassX:
        model.center_of_mass.x = fitted(model.center_of_mass.x, -infinity, infinity);
        break;
      case MotionParameter::kCenterOfMassY:
        model.center_of_mass.y = fitted(model.center_of_mass.y, -infinity, infinity);
        break;
      case MotionParameter::kCenterOfMassZ:
        model.center_of_mass.z = fitted(model.center_of_mass.z, -infinity, infinity);
        break;
    }
  }
  return model;
}

core::Result<MotionCalibration> calibrate_motions(const std::vector<RecordedMotion>& motions,
                                                  const belief::Scene& scene, const MotionPrior& prior,
                                                  const SimulatorFactory& make_simulator,
                                                  const core::RandomStream& stream, core::ThreadPool& pool,
                                                  const MotionCalibrationOptions& options,
                                                  const core::ProgressSink& progress,
                                                  const core::Cancellation* cancellation) {
  PRESCENE_RETURN_IF_ERROR(check(motions, scene, prior, options));
  if (!options.estimate.folds.empty() && options.estimate.folds.size() != motions.size())
    return core::invalid_input("a calibration takes one fold for each recording, or none");
  MotionJudge judge(scene, make_simulator, stream, pool, options, cancellation);
  for (const RecordedMotion& motion : motions) PRESCENE_RETURN_IF_ERROR(judge.add(motion));
  // The valley shows in some of the recordings as well.
  MotionJudge search_judge(scene, make_simulator, stream, pool, options, cancellation);
  for (const std::size_t i : searched(motions.size())) PRESCENE_RETURN_IF_ERROR(search_judge.add(motions[i]));
  const VariedParameters varied(prior, radius_of_gyration(scene.model_of(scene.objects[0])));

  core::Status failure;
  const auto cost_by = [&](const MotionJudge& by, const MotionHypothesis& hypothesis) {
    if (!failure.ok()) return std::numeric_limits<double>::infinity();
    const auto points = by.simulated(hypothesis);
    if (!points) failure = points.status();
    return points ? mean_of(recording_scores(by.observations(), *points)) : std::numeric_limits<double>::infinity();
  };
  const auto cost_of = [&](const MotionHypothesis& hypothesis) { return cost_by(search_judge, hypothesis); };
  MotionCalibration result;
  int tried = 0;
  const auto cost = [&](std::span<const double> values) {
    const double found = cost_of(varied.hypothesis_of(values));
    // The first is what is believed.
    if (tried++ == 0) result.start_cost = cost_by(judge, varied.hypothesis_of(values));
    return found;
  };
  const auto report = [&](const SearchResult& best) {
    if (progress) {
      progress({0.5 * std::min(1.0, static_cast<double>(tried) / options.max_evaluations), std::nullopt,
                "mean score " + std::to_string(best.cost)});
    }
    return failure.ok();
  };
  const auto slides = std::ranges::count(motions, MotionBeginning::kSlide, &RecordedMotion::beginning);
  const double slide_share = static_cast<double>(slides) / static_cast<double>(motions.size());
  const SearchResult found =
      search_from(varied.starts(slide_share < 1.0), cost, options.max_evaluations, stream, report);
  PRESCENE_RETURN_IF_ERROR(failure);

  // The noise goes by what it makes of the score, in turns with the rest.
  MotionHypothesis best = varied.hypothesis_of(found.values);
  Estimate estimate;
  for (int turn = 0; turn < kTurns; ++turn) {
    const bool last = turn + 1 == kTurns;
    const MotionJudge& by = last ? judge : search_judge;
    EstimateOptions estimate_options = options.estimate;
    if (!last) estimate_options.folds.clear();
    const auto simulate = [&](std::span<const double> values) {
      return by.simulated(varied.with_parameters(best, values));
    };
    const auto refined = [&](double share) {
      if (progress) progress({0.5 + 0.5 * (turn + share) / kTurns, std::nullopt, "errors"});
    };
    const std::vector<EstimatedParameter> estimated = varied.estimated(best);
    PRESCENE_TRY(estimate,
                 m_estimate(estimated, by.observations(), simulate,
                            stream.at(static_cast<std::uint64_t>(turn), kTrialDraws), estimate_options, refined));
    // What the recordings hardly identify may end beyond what can be.
    for (std::size_t i = 0; i < estimated.size(); ++i) {
      double& value = estimate.value[static_cast<Eigen::Index>(i)];
      value = std::clamp(value, estimated[i].low, estimated[i].high);
    }
    best = varied.with_parameters(best, std::span(estimate.value.data(), varied.free().size()));
    result.evaluations += estimate.evaluations;
    if (last) break;
    const auto noise_cost = [&](std::span<const double> values) {
      return cost_of(VariedParameters::with_noise(best, values));
    };
    const SearchResult noise =
        coordinate_search(VariedParameters::noise(best), noise_cost, kNoiseHalvings, kNoiseEvaluations, {});
    PRESCENE_RETURN_IF_ERROR(failure);
    best = VariedParameters::with_noise(best, noise.values);
    result.evaluations += noise.evaluations;
  }
  result.parameters = reported(estimate, varied, prior, slide_share, options.position_noise);
  result.without = values_without(estimate, varied, result.parameters);
  result.start_noise = best.start_noise;
  result.friction_scatter = best.friction_scatter;
  result.search_settled = found.settled;
  result.estimate_settled = estimate.settled;
  result.cost = estimate.score;
  result.evaluations += tried;
  return result;
}

}  // namespace prescene::simulation
