// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/calibration/motion_calibration.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "motion_judge.h"
#include "prescene/simulation/calibration/evolution_search.h"

namespace prescene::simulation {
namespace {

using belief::ScalarDistribution;
using geometry::Vector3d;

// Of the search, in the parameters' steps: what comes then needs no better.
constexpr double kSearchAccuracy = 0.05;
// Particles of the stream; a recording's starts are drawn from particle 0.
constexpr std::uint32_t kSearchDraws = 1;
constexpr std::uint32_t kTrialDraws = 2;
// Of estimate and noise.
constexpr int kTurns = 2;
constexpr int kNoiseHalvings = 2;
constexpr int kNoiseEvaluations = 40;

// Of the friction that slides tell, beside its statistical error: by how much simulated slides of known friction were
// off. A third of it is half a step of the simulator, in which a sliding object's velocity lags behind its place.
constexpr double kSlideError = 0.04;
// Of a fitted model, as in scene files.
constexpr double kMostFriction = 100.0;

struct Range {
  double step;  // Half of the first one of the search.
  double low;
  double high;
};

Range range_of(MotionParameter parameter, double radius_of_gyration) {
  switch (parameter) {
    case MotionParameter::kFriction:
    case MotionParameter::kImpactFriction:
      return {0.02, 0.0, 3.0};
    case MotionParameter::kRestitution:
      return {0.03, 0.0, 0.98};
    case MotionParameter::kInertiaSize:
      return {0.06, -1.0, 1.0};
    case MotionParameter::kEdgeRadius:
      return {0.02 * radius_of_gyration, 0.0, 0.3 * radius_of_gyration};
    default:
      return {0.02 * radius_of_gyration, -2.0 * radius_of_gyration, 2.0 * radius_of_gyration};
  }
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// What is varied, as numbers in a row: the parameters that have a prior deviation, then the starts' noise (its
/// logarithm) and the scatter of friction.
class Varied {
 public:
  Varied(const MotionPrior& prior, double gyration) {
    for (std::size_t i = 0; i < kMotionParameters; ++i) {
      fixed_.values[i] = prior[i].mean;
      if (prior[i].deviation == 0.0) continue;
      const auto parameter = static_cast<MotionParameter>(i);
      free_.push_back(i);
      add(to_string(parameter), prior[i], range_of(parameter, gyration));
    }
  }

  /// Places of the free ones in a MotionPrior.
  const std::vector<std::size_t>& free() const { return free_; }
  /// Of the search: the free parameters and the noise.
  std::vector<SearchParameter> searched() const {
    std::vector<SearchParameter> all;
    for (const EstimatedParameter& p : estimated_)
      all.push_back({p.name, std::clamp(p.prior_mean, p.low, p.high), 2.0 * p.scale, p.low, p.high});
    MotionHypothesis start;
    start.start_noise = 3.0;
    start.friction_scatter = 0.03;
    for (const SearchParameter& p : noise(start)) all.push_back(p);
    return all;
  }
  static std::vector<SearchParameter> noise(const MotionHypothesis& at) {
    return {{"start_noise", std::log(at.start_noise), 0.5, std::log(0.3), std::log(300.0)},
            {"friction_scatter", at.friction_scatter, 0.02, 0.0, 0.5}};
  }
  std::vector<EstimatedParameter> estimated(const MotionHypothesis& at) const {
    std::vector<EstimatedParameter> all = estimated_;
    for (std::size_t i = 0; i < all.size(); ++i) {
      all[i].value = at.values[free_[i]];
      all[i].scale = 0.5 * std::min(all[i].scale, all[i].prior_deviation);
    }
    return all;
  }
  MotionHypothesis with_parameters(MotionHypothesis hypothesis, std::span<const double> values) const {
    for (std::size_t i = 0; i < free_.size(); ++i) hypothesis.values[free_[i]] = values[i];
    return hypothesis;
  }
  static MotionHypothesis with_noise(MotionHypothesis hypothesis, std::span<const double> values) {
    hypothesis.start_noise = std::exp(values[0]);
    hypothesis.friction_scatter = values[1];
    return hypothesis;
  }
  /// Of the values of a search.
  MotionHypothesis hypothesis_of(std::span<const double> values) const {
    return with_noise(with_parameters(fixed_, values), values.subspan(free_.size()));
  }

 private:
  void add(const std::string& name, const MotionBelief& belief, const Range& range) {
    estimated_.push_back({name, belief.mean, range.step, range.low, range.high, belief.mean, belief.deviation});
  }

  MotionHypothesis fixed_;
  std::vector<std::size_t> free_;
  std::vector<EstimatedParameter> estimated_;
};

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
                               " parameters take at least " + std::to_string(least_recordings(free)));
  }
  return core::ok_status();
}

}  // namespace

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
  for (const CalibratedParameter& p : found.parameters) {
    const auto normal = [&](double low, double high) {
      return ScalarDistribution(belief::NormalScalar{p.value, p.standard_error, low, high});
    };
    switch (p.parameter) {
      case MotionParameter::kFriction:
        model.contact.friction = normal(0.0, kMostFriction);
        break;
      case MotionParameter::kImpactFriction:
        model.contact.impact_friction = normal(0.0, kMostFriction);
        break;
      case MotionParameter::kRestitution:
        model.contact.restitution = normal(0.0, 1.0);
        break;
      case MotionParameter::kInertiaSize:
        model.unit_inertia *= std::exp(p.value);
        break;
      case MotionParameter::kEdgeRadius:
        model.contact.edge_radius = std::max(0.0, p.value);
        break;
      case MotionParameter::kCenterOfMassX:
        model.center_of_mass.x = normal(-infinity, infinity);
        break;
      case MotionParameter::kCenterOfMassY:
        model.center_of_mass.y = normal(-infinity, infinity);
        break;
      case MotionParameter::kCenterOfMassZ:
        model.center_of_mass.z = normal(-infinity, infinity);
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
  MotionJudge judge(scene, make_simulator, stream, pool, options, cancellation);
  for (const RecordedMotion& motion : motions) PRESCENE_RETURN_IF_ERROR(judge.add(motion));
  const Varied varied(prior, radius_of_gyration(scene.model_of(scene.objects[0])));

  core::Status failure;
  const auto cost_of = [&](const MotionHypothesis& hypothesis) {
    if (!failure.ok()) return std::numeric_limits<double>::infinity();
    const auto points = judge.simulated(hypothesis);
    if (!points) failure = points.status();
    return points ? mean_of(recording_scores(judge.observations(), *points)) : std::numeric_limits<double>::infinity();
  };
  const auto cost = [&](std::span<const double> values) { return cost_of(varied.hypothesis_of(values)); };
  MotionCalibration result;
  const auto report = [&](const SearchResult& best) {
    if (best.evaluations == 1) result.start_cost = best.cost;
    if (progress) {
      progress(
          {0.5 * best.evaluations / options.max_evaluations, std::nullopt, "mean score " + std::to_string(best.cost)});
    }
    return failure.ok();
  };
  const SearchResult found = evolution_search(varied.searched(), cost, kSearchAccuracy, options.max_evaluations,
                                              stream.at(0, kSearchDraws), report);
  PRESCENE_RETURN_IF_ERROR(failure);

  // The noise goes by what it makes of the score, in turns with the rest.
  MotionHypothesis best = varied.hypothesis_of(found.values);
  Estimate estimate;
  for (int turn = 0; turn < kTurns; ++turn) {
    const auto simulate = [&](std::span<const double> values) {
      return judge.simulated(varied.with_parameters(best, values));
    };
    const auto refined = [&](double share) {
      if (progress) progress({0.5 + 0.5 * (turn + share) / kTurns, std::nullopt, "errors"});
    };
    const std::vector<EstimatedParameter> estimated = varied.estimated(best);
    PRESCENE_TRY(estimate,
                 m_estimate(estimated, judge.observations(), simulate,
                            stream.at(static_cast<std::uint64_t>(turn), kTrialDraws), options.estimate, refined));
    // What is hardly told may end beyond what can be.
    for (std::size_t i = 0; i < estimated.size(); ++i) {
      double& value = estimate.value[static_cast<Eigen::Index>(i)];
      value = std::clamp(value, estimated[i].low, estimated[i].high);
    }
    best = varied.with_parameters(best, std::span(estimate.value.data(), varied.free().size()));
    result.evaluations += estimate.evaluations;
    if (turn + 1 == kTurns) break;
    const auto noise_cost = [&](std::span<const double> values) { return cost_of(varied.with_noise(best, values)); };
    const SearchResult noise = coordinate_search(varied.noise(best), noise_cost, kNoiseHalvings, kNoiseEvaluations, {});
    PRESCENE_RETURN_IF_ERROR(failure);
    best = varied.with_noise(best, noise.values);
    result.evaluations += noise.evaluations;
  }
  const auto slides = std::ranges::count(motions, MotionBeginning::kSlide, &RecordedMotion::beginning);
  const double slide_share = static_cast<double>(slides) / static_cast<double>(motions.size());
  for (std::size_t i = 0; i < varied.free().size(); ++i) {
    const std::size_t k = varied.free()[i];
    const auto parameter = static_cast<MotionParameter>(k);
    const auto row = static_cast<Eigen::Index>(i);
    double error = estimate.standard_error(row);
    if (parameter == MotionParameter::kFriction)
      error = std::min(std::hypot(error, kSlideError * slide_share * estimate.value[row]), prior[k].deviation);
    result.parameters.push_back({parameter, estimate.value[row], error, error / prior[k].deviation});
  }
  result.start_noise = best.start_noise;
  result.friction_scatter = best.friction_scatter;
  result.settled = estimate.settled;
  result.cost = estimate.score;
  result.evaluations += found.evaluations;
  return result;
}

}  // namespace prescene::simulation
