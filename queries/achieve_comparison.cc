// SPDX-License-Identifier: Apache-2.0
#include "prescene/queries/achieve_comparison.h"

#include <algorithm>
#include <cmath>

#include "prepared_search.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"

namespace prescene::queries {
namespace {

/// Trials at points that are drawn from a stream.
class Sampler {
 public:
  Sampler(PreparedSearch& search, core::RandomStream stream)
      : trials_(*search.trials), dimensions_(search.options.periodic.size()), stream_(stream) {}

  UnitPoint anywhere() {
    UnitPoint point(dimensions_);
    for (double& coordinate : point) coordinate = stream_.uniform();
    return point;
  }
  /// Successes of trials in scenarios that no other trial has; nothing: it was stopped.
  std::optional<std::vector<int>> classes(std::span<const UnitPoint> points) {
    std::vector<Trial> trials;
    for (const UnitPoint& point : points) trials.push_back({point, next_++, true});
    std::vector<TrialEnd> ends(trials.size());
    if (!trials_.run(trials, ends)) return std::nullopt;
    std::vector<int> classes;
    for (const TrialEnd end : ends) classes.push_back(end == TrialEnd::kSucceeds ? 0 : 1);
    return classes;
  }
  core::RandomStream& stream() { return stream_; }

 private:
  ActionTrials& trials_;
  std::size_t dimensions_;
  core::RandomStream stream_;
  std::uint32_t next_ = 0;
};

core::Status stopped() { return core::cancelled("stopped before the comparison was finished"); }

/// Where a value of a parameter lies in its range.
double unit_of(const FreeParameter& parameter, double value) {
  return (value - parameter.low) / (parameter.high - parameter.low);
}

}  // namespace

core::Result<SampledSearch> sample_and_evaluate(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                                const belief::AchieveQuery& query, const QueryContext& context,
                                                const SamplingOptions& options) {
  const Prior prior = prior_of(scene, seed);
  PRESCENE_TRY(const auto search, prepare_search(prior, query, context));
  Sampler sampler(*search, prior.stream.for_purpose(core::Purpose::kEvaluation));
  SampledSearch sampled;
  // A limit for ranges in which nothing is possible.
  for (int drawn = 0; drawn < 100 * options.most_choices && sampled.choices < options.most_choices && !sampled.found;
       ++drawn) {
    const UnitPoint point = sampler.anywhere();
    if (!search->trials->possible(point)) continue;
    ++sampled.choices;
    simulation::ComponentClasses all;
    for (;;) {
      const auto size = static_cast<std::size_t>(simulation::next_net_size(static_cast<int>(all.classes.size())));
      const auto more = sampler.classes(std::vector<UnitPoint>(size - all.classes.size(), point));
      if (!more) return stopped();
      all.classes.insert(all.classes.end(), more->begin(), more->end());
      const simulation::ClassEstimate estimate =
          simulation::class_estimate(std::span(&all, 1), 0, query.effort.confidence);
      sampled.found = estimate.low >= query.probability;
      if (sampled.found || estimate.half_width <= options.tolerance) break;
      if (options.reject_early && estimate.high < query.probability) break;
    }
  }
  sampled.instances = search->trials->basis().instances;
  sampled.simulated_seconds = search->trials->basis().simulated_seconds;
  return sampled;
}

core::Result<CheckedChoice> check_choice(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                         const belief::AchieveQuery& query, const QueryContext& context,
                                         const belief::ActionChoice& choice, int instances) {
  const Prior prior = prior_of(scene, seed);
  PRESCENE_TRY(const auto search, prepare_search(prior, query, context));
  const std::vector<FreeParameter>& free = search->plan->free();
  if (choice.values.size() != free.size())
    return core::invalid_input("the choice has another number of values than the question has free parameters");
  Sampler sampler(*search, prior.stream.for_purpose(core::Purpose::kEvaluation));
  std::vector<UnitPoint> points;
  for (int i = 0; i < instances; ++i) {
    UnitPoint point;
    for (std::size_t k = 0; k < free.size(); ++k) {
      double value = choice.values[k];
      if (!choice.low.empty()) value = choice.low[k] + (choice.high[k] - choice.low[k]) * sampler.stream().uniform();
      const double unit = unit_of(free[k], value);
      point.push_back(free[k].periodic() ? unit - std::floor(unit) : std::clamp(unit, 0.0, 1.0));
    }
    if (search->trials->possible(point)) points.push_back(std::move(point));
  }
  const auto classes = sampler.classes(points);
  if (!classes) return stopped();
  return CheckedChoice{instances, static_cast<int>(std::count(classes->begin(), classes->end(), 0))};
}

core::Result<double> share_of_choices(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                      const belief::AchieveQuery& query, const QueryContext& context, int choices,
                                      int instances) {
  const Prior prior = prior_of(scene, seed);
  PRESCENE_TRY(const auto search, prepare_search(prior, query, context));
  Sampler sampler(*search, prior.stream.for_purpose(core::Purpose::kEvaluation));
  int reached = 0;
  for (int i = 0; i < choices; ++i) {
    const UnitPoint point = sampler.anywhere();
    if (!search->trials->possible(point)) continue;
    const auto classes = sampler.classes(std::vector<UnitPoint>(static_cast<std::size_t>(instances), point));
    if (!classes) return stopped();
    const auto successes = static_cast<double>(std::count(classes->begin(), classes->end(), 0));
    reached += successes >= query.probability * instances;
  }
  return static_cast<double>(reached) / choices;
}

}  // namespace prescene::queries
