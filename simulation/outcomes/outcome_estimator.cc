// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/outcome_estimator.h"

#include <algorithm>
#include <optional>

#include "audited_runs.h"
#include "estimate_forecast.h"
#include "instance_plan.h"
#include "prescene/core/check.h"
#include "prescene/core/clock.h"
#include "prescene/simulation/rules/action_draws.h"

namespace prescene::simulation {
namespace {

// Chunks that are done sooner than this (s) are made larger: simulators may do many at once for less.
constexpr double kShortChunk = 0.02;
constexpr std::size_t kLargestChunk = 1024;

/// Instances run between two looks at the clock, at first. Does not change results.
std::size_t chunk_size(const core::ThreadPool& pool) {
  return std::max<std::size_t>(32, 8 * static_cast<std::size_t>(pool.threads()));
}

/// Most instances whose states fit into the memory for runs under way, each kept for the whole of the duration.
std::size_t largest_chunk(const StartDistribution& starts, const std::vector<StartSampler>& samplers,
                          const RunRequest& request, std::size_t bytes) {
  if (!(request.sample_interval > 0.0) || starts.components.empty()) return kLargestChunk;
  const std::size_t objects = samplers.front().draw(0).objects.size();
  return std::clamp<std::size_t>(bytes / bytes_of_run(request, objects), 1, kLargestChunk);
}

/// Of each instance; they sum to one.
std::vector<double> weights_of(const StartDistribution& starts, const std::vector<InstanceRecord>& records) {
  std::vector<double> counts(starts.components.size(), 0.0);
  for (const InstanceRecord& record : records) counts[static_cast<std::size_t>(record.component)] += 1.0;
  double weight_sum = 0.0;
  for (std::size_t k = 0; k < counts.size(); ++k)
    if (counts[k] > 0.0) weight_sum += starts.components[k].weight;
  std::vector<double> weights;
  for (const InstanceRecord& record : records) {
    const auto k = static_cast<std::size_t>(record.component);
    weights.push_back(starts.components[k].weight / (weight_sum * counts[k]));
  }
  return weights;
}

/// Fills in weights and totals from the records.
void weigh(const StartDistribution& starts, OutcomeEstimate& estimate) {
  estimate.simulated_seconds = estimate.flown_seconds = 0.0;
  estimate.failed = 0;
  const std::vector<double> weights = weights_of(starts, estimate.instances);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    InstanceRecord& record = estimate.instances[i];
    record.weight = weights[i];
    estimate.failed += record.failed ? 1 : 0;
    estimate.simulated_seconds += record.simulated_seconds;
    estimate.flown_seconds += record.flown_seconds;
  }
}

using IntervalRule = ClassEstimate(std::span<const ComponentClasses> components, int which, double confidence);

/// Shares and intervals, by `rule`, of what was weighed, and whether all are narrow enough.
void evaluate(const StartDistribution& starts, std::span<const Variable> variables, IntervalRule& rule,
              double confidence, double tolerance, OutcomeEstimate& estimate) {
  std::vector<ComponentClasses> components(starts.components.size());
  for (std::size_t k = 0; k < components.size(); ++k) components[k].weight = starts.components[k].weight;
  const CertificateUse& use = estimate.certificates;
  double doubt = 0.0;
  if (!use.switched_off && use.mismatches > 0)
    doubt = static_cast<double>(use.mismatches) / use.audited * use.certified /
            static_cast<double>(estimate.instances.size());
  double failed_share = 0.0;
  for (const InstanceRecord& record : estimate.instances)
    if (record.failed) failed_share += record.weight;
  estimate.converged = true;
  estimate.variables.clear();
  for (std::size_t v = 0; v < variables.size(); ++v) {
    for (ComponentClasses& component : components) component.classes.clear();
    for (const InstanceRecord& record : estimate.instances)
      components[static_cast<std::size_t>(record.component)].classes.push_back(record.classes[v]);
    VariableEstimate& variable = estimate.variables.emplace_back();
    for (std::size_t c = 0; c < variables[v].classes.size(); ++c) {
      ClassEstimate& found = variable.classes.emplace_back(rule(components, static_cast<int>(c), confidence));
      if (estimate.certain) found.low = found.high = found.probability, found.half_width = 0.0;
      found.half_width += doubt + failed_share;
      found.low = std::max(0.0, found.low - doubt);
      found.high = std::min(1.0, found.high + doubt + failed_share);
      estimate.converged = estimate.converged && variable.classes.back().half_width <= tolerance;
    }
  }
}

/// Tells whoever wants to know what is known so far. Each look has its share of the tolerated error.
class Looks {
 public:
  Looks(const StartDistribution& starts, std::span<const Variable> variables, const EstimatorOptions& options)
      : starts_(starts), variables_(variables), options_(options) {}

  /// Instances after which there is a look before the net has grown; more than `done`, at most `target`. Of two threads
  /// each fills one vector of eight lanes with the first: fewer instances hardly take less time.
  std::size_t end_of_chunks(std::size_t done, std::size_t target) const {
    for (const std::size_t count : kEarly)
      if (options_.on_look && done < count) return std::min(count, target);
    return target;
  }
  /// Whether that is now, and each component has some of them.
  bool wants_early(const OutcomeEstimate& estimate) const {
    constexpr int kFewest = 4;  // of a component: fewer say nothing of how it scatters
    if (!options_.on_look || estimate.certain) return false;
    if (std::ranges::find(kEarly, estimate.instances.size()) == std::end(kEarly)) return false;
    std::vector<int> counts(starts_.components.size(), 0);
    for (const InstanceRecord& record : estimate.instances) ++counts[static_cast<std::size_t>(record.component)];
    return std::all_of(counts.begin(), counts.end(), [](int count) { return count >= kFewest; });
  }

  /// Of an estimate that was weighed; it is as before when this returns.
  void tell(OutcomeEstimate& estimate, double wall_seconds) {
    if (!options_.on_look || estimate.certain || estimate.instances.empty()) return;
    const double error = (1.0 - options_.confidence) * next_share(estimate.instances.size());
    std::vector<VariableEstimate> own = std::move(estimate.variables);
    const bool converged = estimate.converged;
    evaluate(starts_, variables_, look_estimate, 1.0 - error, options_.tolerance, estimate);
    estimate.wall_seconds = wall_seconds;
    options_.on_look(estimate);
    estimate.variables = std::move(own);
    estimate.converged = converged;
  }

 private:
  static constexpr std::size_t kEarly[] = {16, 32};
  // Of the tolerated error, for the first of these. It comes out wide whatever its share; this one widens later looks
  // by 2 %.
  static constexpr double kShareOfFirst = 0.125;

  /// Of the tolerated error; those of all looks that there may be sum to one.
  double next_share(std::size_t instances) {
    if (instances == kEarly[0]) return kShareOfFirst;
    const double look = ++looks_;
    return (1.0 - kShareOfFirst) / (look * (look + 1.0));
  }

  const StartDistribution& starts_;
  std::span<const Variable> variables_;
  const EstimatorOptions& options_;
  int looks_ = 0;  // but for the first of kEarly
};

bool nothing_is_random(const StartDistribution& starts, const RunRequest& request) {
  return action_dimensions(request.actions) == 0 &&
         std::all_of(starts.components.begin(), starts.components.end(),
                     [](const StartComponent& component) { return component.dimensions == 0; });
}

/// What the audit found until now, into the estimate; where certificates fail, all instances run to rest instead, and
/// none is certified any more. False when that was cancelled.
bool audit(double tolerated_mismatch, InstanceRunner& runner, AuditTrail& trail, OutcomeEstimate& estimate) {
  bool switched_off = estimate.certificates.switched_off;
  bool cancelled = false;
  if (runner.certifier && trail.fails(estimate.instances.size(), tolerated_mismatch)) {
    switched_off = repair_certified(runner, trail, tolerated_mismatch, estimate.instances, cancelled);
    runner.certifier = nullptr;
  }
  estimate.certificates = trail.use_of(estimate.instances.size());
  estimate.certificates.switched_off = switched_off;
  return !cancelled;
}

/// The stop rule: why a net of `target` instances, all of which were run and evaluated, does not grow any more.
std::optional<EstimateStop> end_of_net(const OutcomeEstimate& estimate, const EstimatorOptions& options,
                                       std::size_t target, std::size_t limit) {
  if (estimate.certain) return EstimateStop::kConverged;
  if (options.exact_instances) return target == limit ? std::optional(EstimateStop::kExact) : std::nullopt;
  if (estimate.converged && target >= static_cast<std::size_t>(std::max(0, options.min_instances)))
    return EstimateStop::kConverged;
  return target == limit ? std::optional(EstimateStop::kMaxInstances) : std::nullopt;
}

}  // namespace

std::string to_string(EstimateStop stop) {
  switch (stop) {
    case EstimateStop::kConverged:
      return "converged";
    case EstimateStop::kMaxInstances:
      return "max_instances";
    case EstimateStop::kExact:
      return "exact";
    case EstimateStop::kTimeLimit:
      return "time_limit";
    case EstimateStop::kCancelled:
      return "cancelled";
  }
  return "unknown";
}

std::size_t bytes_of_run(const RunRequest& request, std::size_t objects) {
  const double states = 2.0 + (request.sample_interval > 0.0 ? request.stop.duration / request.sample_interval : 0.0);
  const auto state = static_cast<double>(sizeof(belief::WorldState) + objects * sizeof(belief::ObjectState));
  return static_cast<std::size_t>(std::min(states * state, 1e15));
}

OutcomeEstimate estimate_outcomes(const Simulator& simulator, const StartDistribution& starts,
                                  std::span<const Variable> variables, const RunRequest& request,
                                  const core::RandomStream& stream, const EstimatorOptions& options,
                                  core::ThreadPool& pool, const core::Cancellation* cancellation,
                                  const core::ProgressSink& progress) {
  PRESCENE_CHECK(!starts.components.empty());
  PRESCENE_CHECK(options.tolerance > 0.0 && options.confidence > 0.0 && options.confidence < 1.0);
  PRESCENE_CHECK(options.max_instances > 0 && (!options.exact_instances || *options.exact_instances > 0));
  const core::Stopwatch watch;
  const double cpu_before = core::process_cpu_seconds();
  const std::vector<StartSampler> samplers = samplers_of(starts, stream);
  std::vector<double> weights;
  for (const StartComponent& component : starts.components) weights.push_back(component.weight);
  InstancePlan plan(weights);
  const std::size_t limit =
      static_cast<std::size_t>(options.exact_instances ? *options.exact_instances : options.max_instances);

  PRESCENE_CHECK(options.audit_share >= 0.0 && options.audit_share <= 1.0);
  OutcomeEstimate estimate;
  AuditTrail trail;
  InstanceRunner runner{simulator,
                        variables,
                        request,
                        stream,
                        pool,
                        cancellation,
                        samplers,
                        options.certifier,
                        options.audit_share,
                        options.keep_contacts};
  estimate.certain = nothing_is_random(starts, request) && starts.components.size() <= limit;
  EstimateForecast forecast(options, progress);
  Looks looks(starts, variables, options);
  const std::size_t most_at_once = largest_chunk(starts, samplers, request, options.bytes_of_runs);
  std::size_t chunk = std::min(chunk_size(pool), most_at_once);
  std::optional<EstimateStop> stop;
  while (!stop) {
    if (estimate.certain)
      plan.once();
    else
      plan.grow();
    const std::size_t target = std::min(limit, plan.order().size());
    while (!stop && estimate.instances.size() < target) {
      const std::size_t done = estimate.instances.size();
      // Of whatever size chunks are, looks are at the same instances.
      const std::size_t end = looks.end_of_chunks(done, target);
      const auto planned = std::span(plan.order()).subspan(done, std::min(chunk, end - done));
      const double begun = watch.seconds();
      if (!run_chunk(runner, planned, estimate.instances, trail) || (cancellation && cancellation->requested()))
        stop = EstimateStop::kCancelled;
      else if (options.max_seconds && !options.exact_instances && watch.seconds() >= *options.max_seconds)
        stop = EstimateStop::kTimeLimit;
      if (watch.seconds() - begun < kShortChunk) chunk = std::min(2 * chunk, most_at_once);
      forecast.report(static_cast<double>(estimate.instances.size()));
      // What is known of the whole net is told below.
      if (!stop && estimate.instances.size() < target && looks.wants_early(estimate) &&
          !trail.fails(estimate.instances.size(), options.tolerated_mismatch)) {
        estimate.certificates = trail.use_of(estimate.instances.size());
        weigh(starts, estimate);
        looks.tell(estimate, watch.seconds());
      }
    }
    if (!audit(options.tolerated_mismatch, runner, trail, estimate)) stop = EstimateStop::kCancelled;
    weigh(starts, estimate);
    estimate.variables.clear();
    estimate.converged = false;
    if (!estimate.instances.empty()) {
      evaluate(starts, variables, class_estimate, options.confidence, options.tolerance, estimate);
      estimate.history.push_back({static_cast<int>(estimate.instances.size()), estimate.variables});
      looks.tell(estimate, watch.seconds());
    }
    forecast.stage_done(variables, estimate);
    // Whoever gave a time may also cancel when it is over.
    if (stop == EstimateStop::kCancelled && options.max_seconds && watch.seconds() >= *options.max_seconds)
      stop = EstimateStop::kTimeLimit;
    if (!stop) stop = end_of_net(estimate, options, target, limit);
  }
  estimate.stop = *stop;
  estimate.wall_seconds = watch.seconds();
  estimate.cpu_seconds = core::process_cpu_seconds() - cpu_before;
  return estimate;
}

belief::Trajectory run_instance(const Simulator& simulator, const StartDistribution& starts,
                                const OutcomeEstimate& estimate, std::size_t index, const RunRequest& request,
                                const core::RandomStream& stream, core::ThreadPool& pool,
                                const core::Cancellation* cancellation) {
  PRESCENE_CHECK(index < estimate.instances.size());
  const InstanceRecord& record = estimate.instances[index];
  const std::vector<StartSampler> samplers = samplers_of(starts, stream);
  const belief::WorldState start = samplers[static_cast<std::size_t>(record.component)].draw(record.point);
  belief::Trajectory trajectory;
  simulator.run(std::span(&start, 1), request, stream, static_cast<std::uint32_t>(index), pool,
                std::span(&trajectory, 1), cancellation);
  return trajectory;
}

}  // namespace prescene::simulation
