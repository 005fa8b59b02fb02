// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/outcomes/outcome_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "instance_classes.h"
#include "instance_plan.h"
#include "prescene/core/check.h"
#include "prescene/core/clock.h"
#include "prescene/core/text.h"
#include "prescene/simulation/rules/action_draws.h"

namespace prescene::simulation {
namespace {

// Chunks that are done sooner than this (s) are made larger: simulators may do many at once for less.
constexpr double kShortChunk = 0.02;
constexpr double kJudgedAfterCancelling = 0.1;  // s, at most, in which finished runs are still judged
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

/// Forecasts how many instances the stop rule will take, from how the widest interval shrank so far.
class Forecast {
 public:
  Forecast(const EstimatorOptions& options, core::ProgressSink sink) : options_(options), sink_(std::move(sink)) {
    expected_ = options.exact_instances ? *options.exact_instances : options.max_instances;
  }

  void stage_done(double count, double widest, std::string settled) {
    settled_ = std::move(settled);
    if (options_.exact_instances) return;
    // Between the rates of independent draws (1/2) and of nets in smooth problems (1); 0.6 until two stages are known.
    double rate = 0.6;
    if (!std::isfinite(widest)) {
      expected_ = options_.max_instances;
      return;
    }
    if (first_count_ == 0.0) {
      first_count_ = count;
      first_widest_ = widest;
    } else if (widest > 0.0 && count > first_count_) {
      rate = std::clamp(std::log(first_widest_ / widest) / std::log(count / first_count_), 0.5, 1.0);
    }
    const double wanted = count * std::pow(std::max(1.0, widest / options_.tolerance), 1.0 / rate);
    const double limit = options_.max_instances;
    // Of an interval without end nothing can be forecast; `wanted` is no number then.
    expected_ =
        wanted < limit ? std::min(limit, static_cast<double>(next_net_size(static_cast<int>(wanted) - 1))) : limit;
  }

  void report(double done) {
    if (!sink_) return;
    const double elapsed = watch_.seconds();
    const double total = std::max(done, expected_);
    double left = done > 0.0 ? elapsed * (total - done) / done : 0.0;
    double fraction = done / total;
    if (options_.max_seconds && *options_.max_seconds < elapsed + left) {
      left = std::max(0.0, *options_.max_seconds - elapsed);
      fraction = std::max(fraction, elapsed / (elapsed + left));
    }
    shown_ = std::clamp(fraction, shown_, 1.0);  // a bar never runs backwards
    sink_({shown_, left,
           std::to_string(static_cast<int>(done)) + " of about " + std::to_string(static_cast<int>(total)) +
               " instances" + settled_});
  }

 private:
  EstimatorOptions options_;
  core::ProgressSink sink_;
  core::Stopwatch watch_;
  double expected_;
  double first_count_ = 0.0, first_widest_ = 0.0;
  double shown_ = 0.0;
  std::string settled_;
};

/// All that running instances takes.
struct Runner {
  const Simulator& simulator;
  std::span<const Variable> variables;
  RunRequest request;
  const core::RandomStream& stream;
  core::ThreadPool& pool;
  const core::Cancellation* cancellation;
  const std::vector<StartSampler>& samplers;
  const Certifier* certifier;  // null: run all to rest
  double audit_share;
  bool keep_contacts;
};

void note_run(const Runner& runner, belief::Trajectory& run, InstanceRecord& record) {
  record.classes = classes_of(run, runner.variables, runner.certifier, runner.request.stop.duration);
  record.certified = run.end == belief::TrajectoryEnd::kDecided;
  record.failed = run.end == belief::TrajectoryEnd::kDiverged;
  record.final = std::move(run.states.back());
  record.end = run.end;
  record.deepest_overlap = std::max(record.deepest_overlap, run.deepest_overlap);
  record.dropped_contacts = std::max(record.dropped_contacts, run.dropped_contacts);
  if (runner.keep_contacts) record.contacts = std::move(run.contacts);
  record.simulated_seconds += run.simulated_seconds;
  record.flown_seconds += run.flown_seconds;
}

/// Runs the instances of these numbers to rest and replaces their records; returns how many, in order, were not
/// cancelled. `changed` gets those whose classes change.
std::size_t run_to_rest(const Runner& runner, std::span<const std::uint32_t> numbers,
                        std::vector<InstanceRecord>& records, std::vector<std::uint32_t>& changed) {
  RunRequest request = runner.request;
  request.end_rule = nullptr;
  std::vector<belief::WorldState> starts;
  for (const std::uint32_t number : numbers)
    starts.push_back(runner.samplers[static_cast<std::size_t>(records[number].component)].draw(records[number].point));
  std::vector<belief::Trajectory> runs(numbers.size());
  runner.simulator.run(starts, request, runner.stream, numbers, runner.pool, runs, runner.cancellation);
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    if (runs[n].end == belief::TrajectoryEnd::kCancelled) return n;
    InstanceRecord& record = records[numbers[n]];
    const std::vector<int> before = record.classes;
    note_run(runner, runs[n], record);
    if (record.classes != before) changed.push_back(numbers[n]);
  }
  return numbers.size();
}

/// Numbers of the instances that ended by a certificate, ascending.
struct AuditTrail {
  std::vector<std::uint32_t> certified, audited, mismatched;

  /// Of the first `count` instances, whatever became of the others.
  CertificateUse use_of(std::size_t count) const {
    const auto below = [&](const std::vector<std::uint32_t>& numbers) {
      return static_cast<int>(std::ranges::lower_bound(numbers, count) - numbers.begin());
    };
    return {below(certified), below(audited), below(mismatched), false};
  }
  bool fails(std::size_t count, double tolerated) const {
    const CertificateUse use = use_of(count);
    return use.mismatches > tolerated * use.audited;
  }
};

/// Runs `planned` (numbers first, first + 1, ... of the order) and appends the records of those that were finished
/// before any that was cancelled. Returns false when one was.
bool run_chunk(const Runner& runner, std::span<const PlannedInstance> planned, std::vector<InstanceRecord>& records,
               AuditTrail& trail) {
  const std::size_t first = records.size();
  std::vector<belief::WorldState> starts(planned.size());
  runner.pool.for_each_index(planned.size(), [&](std::size_t i) {
    starts[i] = runner.samplers[static_cast<std::size_t>(planned[i].component)].draw(planned[i].point);
  });
  std::vector<belief::Trajectory> runs(planned.size());
  RunRequest request = runner.request;
  request.end_rule = runner.certifier;
  runner.simulator.run(starts, request, runner.stream, static_cast<std::uint32_t>(first), runner.pool, runs,
                       runner.cancellation);

  std::size_t finished = 0;
  while (finished < runs.size() && runs[finished].end != belief::TrajectoryEnd::kCancelled) ++finished;
  records.resize(first + finished);
  // What was cancelled in its runs keeps those that were finished; but judging many outcomes over many states takes its
  // time too, and whoever cancels does not wait for long.
  std::vector<std::uint8_t> noted(finished, 0);
  const core::Stopwatch judging;
  runner.pool.for_each_index(finished, [&](std::size_t i) {
    if (runner.cancellation && judging.seconds() > kJudgedAfterCancelling && runner.cancellation->requested()) return;
    InstanceRecord& record = records[first + i];
    record.component = planned[i].component;
    record.point = planned[i].point;
    note_run(runner, runs[i], record);
    noted[i] = 1;
  });
  finished = static_cast<std::size_t>(std::find(noted.begin(), noted.end(), 0) - noted.begin());
  records.resize(first + finished);
  std::vector<std::uint32_t> audited;
  for (auto n = static_cast<std::uint32_t>(first); n < first + finished; ++n) {
    if (!records[n].certified) continue;
    trail.certified.push_back(n);
    core::RandomStream draw = runner.stream.for_purpose(core::Purpose::kAudit).at(0, n);
    if (draw.uniform() < runner.audit_share) audited.push_back(n);
  }
  const std::size_t done = run_to_rest(runner, audited, records, trail.mismatched);
  trail.audited.insert(trail.audited.end(), audited.begin(), audited.begin() + static_cast<std::ptrdiff_t>(done));
  if (done < audited.size()) records.resize(audited[done]);
  return finished == runs.size() && done == audited.size();
}

/// Runs to rest what ended by its certificate; returns whether certificates count for nothing then. Cancelled on the
/// way, it cuts to the instances that were repaired, or to those of which the audit had not failed, if those are more:
/// a replay of so many comes to the same.
bool repair(const Runner& runner, const AuditTrail& trail, double tolerated, std::vector<InstanceRecord>& records,
            bool& cancelled) {
  std::vector<InstanceRecord> repaired = records;
  std::vector<std::uint32_t> numbers, changed;
  for (std::uint32_t n = 0; n < records.size(); ++n)
    if (records[n].certified) numbers.push_back(n);
  const std::size_t done = run_to_rest(runner, numbers, repaired, changed);
  cancelled = done < numbers.size();
  if (cancelled) {
    repaired.resize(numbers[done]);
    std::size_t sound = records.size();
    while (trail.fails(sound, tolerated)) --sound;
    if (sound >= repaired.size()) {
      records.resize(sound);
      return false;
    }
  }
  records = std::move(repaired);
  return true;
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

double widest_half(const OutcomeEstimate& estimate) {
  double widest = 0.0;
  for (const VariableEstimate& variable : estimate.variables)
    for (const ClassEstimate& one : variable.classes)
      widest = std::isnan(one.half_width) ? std::numeric_limits<double>::infinity() : std::max(widest, one.half_width);
  return widest;
}

/// The likeliest classes of the first variable, for progress: ", in_bin 0.62 +-0.03, ...".
std::string settled_text(std::span<const Variable> variables, const OutcomeEstimate& estimate) {
  constexpr std::size_t kShown = 3;
  if (estimate.variables.empty()) return {};
  const std::vector<ClassEstimate>& classes = estimate.variables[0].classes;
  std::vector<std::size_t> order(variables[0].name.empty() ? 1 : classes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return classes[a].probability > classes[b].probability; });
  std::string text;
  for (std::size_t c : std::span(order).first(std::min(kShown, order.size())))
    text += ", " + variables[0].classes[c] + " " + core::fixed_text(classes[c].probability, 2) + " +-" +
            core::fixed_text(classes[c].half_width, 2);
  return text;
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
  Runner runner{simulator,
                variables,
                request,
                stream,
                pool,
                cancellation,
                samplers,
                options.certifier,
                options.audit_share,
                options.keep_contacts};
  estimate.certain = action_dimensions(request.actions) == 0 &&
                     std::all_of(starts.components.begin(), starts.components.end(),
                                 [](const StartComponent& component) { return component.dimensions == 0; }) &&
                     starts.components.size() <= limit;
  Forecast forecast(options, progress);
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
    bool switched_off = estimate.certificates.switched_off;
    if (runner.certifier && trail.fails(estimate.instances.size(), options.tolerated_mismatch)) {
      bool cancelled = false;
      switched_off = repair(runner, trail, options.tolerated_mismatch, estimate.instances, cancelled);
      if (cancelled) stop = EstimateStop::kCancelled;
      runner.certifier = nullptr;
    }
    estimate.certificates = trail.use_of(estimate.instances.size());
    estimate.certificates.switched_off = switched_off;
    weigh(starts, estimate);
    estimate.variables.clear();
    estimate.converged = false;
    if (!estimate.instances.empty()) {
      evaluate(starts, variables, class_estimate, options.confidence, options.tolerance, estimate);
      estimate.history.push_back({static_cast<int>(estimate.instances.size()), estimate.variables});
      looks.tell(estimate, watch.seconds());
    }
    forecast.stage_done(static_cast<double>(estimate.instances.size()), widest_half(estimate),
                        settled_text(variables, estimate));
    // Whoever gave a time may also cancel when it is over.
    if (stop == EstimateStop::kCancelled && options.max_seconds && watch.seconds() >= *options.max_seconds)
      stop = EstimateStop::kTimeLimit;
    if (stop) break;
    if (estimate.certain) {
      stop = EstimateStop::kConverged;
    } else if (options.exact_instances) {
      if (target == limit) stop = EstimateStop::kExact;
    } else if (estimate.converged && target >= static_cast<std::size_t>(std::max(0, options.min_instances))) {
      stop = EstimateStop::kConverged;
    } else if (target == limit) {
      stop = EstimateStop::kMaxInstances;
    }
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
