// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "foresee.h"
#include "prescene/belief/query_limits.h"
#include "prescene/belief/scene_size.h"
#include "prescene/core/text.h"
#include "prescene/queries/typical_runs.h"

namespace prescene::queries {
namespace {

// s, of things of household size; 20 ms is up to 10 cm of a fall.
constexpr double kJudgingInterval = 0.02;
// m/s, after a fall from 1.3 m, and more of large things. Volumes are looked into as often as this passes through them.
constexpr double kPassingSpeed = 5.0;
constexpr double kTimelineInterval = 1.0 / 30.0;
// Where nothing is asked but where things end, as many instances as a heat map of good quality takes.
constexpr int kUnaskedInstances = 256;
// Of an instance's record besides its objects' states: its classes, and contacts where they are kept.
constexpr std::size_t kRecordBytes = 256, kContactsBytes = 4096;
// Object states of a run in an answer: an answer holds twelve such, about 3 MB each.
constexpr double kMostStatesTold = 8000.0;

/// The shorter of two intervals, of which 0 stands for none.
double shorter(double a, double b) { return a > 0.0 && b > 0.0 ? std::min(a, b) : std::max(a, b); }

double judging_interval(const belief::Outcome& outcome, const simulation::Simulator& simulator) {
  if (!belief::needs_states_along_the_way(outcome)) return 0.0;
  // Times and speeds of similar things grow with the square root of their size; but small things, too, fall from
  // tables.
  const double similar = std::sqrt(simulator.length_scale());
  const double usual = kJudgingInterval * std::min(1.0, similar), step = simulator.step_size();
  double passing = usual;
  for (const belief::Condition& condition : belief::all_conditions(outcome)) {
    const auto* inside = std::get_if<belief::InsideVolume>(&condition.predicate);
    if (inside && condition.when != belief::When::kAtEnd && inside->hollow_of.empty())
      passing = std::min(passing, inside->size.minCoeff() / (kPassingSpeed * std::max(1.0, similar)));
  }
  // States are of whole steps: never farther apart than that.
  return passing < usual ? std::max(1.0, std::floor(passing / step)) * step : std::max(usual, step);
}

double judging_interval(const belief::Scene& scene, const simulation::Simulator& simulator) {
  double interval = queries::judging_interval(scene.outcomes, simulator);
  for (const belief::ExclusiveOutcomes& group : scene.exclusive_outcomes)
    interval = shorter(interval, queries::judging_interval(group.outcomes, simulator));
  return interval;
}

}  // namespace

double judging_interval(std::span<const belief::Outcome> outcomes, const simulation::Simulator& simulator) {
  double interval = 0.0;
  for (const belief::Outcome& outcome : outcomes) interval = shorter(interval, judging_interval(outcome, simulator));
  return interval;
}

core::Cancellation end_of_simulating(const QueryContext& context) {
  static const core::Cancellation kNever;
  return {context.cancellation ? *context.cancellation : kNever,
          context.simulate_until.value_or(core::Cancellation::Clock::time_point::max())};
}

std::unique_ptr<const simulation::Certifier> certifier_of(const Foresight& foresight, double duration,
                                                          const QueryContext& context) {
  // What is certain of a free body is not of one on a joint.
  if (foresight.variables.empty() || !foresight.scene->joints.empty()) return nullptr;
  simulation::RunRequest request = foresight.request;
  request.stop.duration = duration;
  const core::Cancellation until = end_of_simulating(context);
  return simulation::make_certifier(foresight.scene, foresight.variables, request,
                                    {.shapes = context.shapes,
                                     .edge_rounding = context.edge_rounding,
                                     .length_scale = foresight.simulator->length_scale(),
                                     .cancellation = &until});
}

core::Result<Foresight> foresee(const Prior& prior, std::shared_ptr<const belief::Scene> scene, double duration,
                                const belief::Effort& effort, const QueryContext& context,
                                const ForesightDetail& detail) {
  if (!context.make_simulator) return core::unavailable("no simulator: this service was set up without one");

  Foresight foresight;
  PRESCENE_TRY(foresight.simulator, context.make_simulator(*scene, 1.0));
  const double step = foresight.simulator->step_size();
  if (!(duration >= step && duration <= belief::kDurations.high))
    return core::invalid_input("a duration of " + core::rounded_text(duration) +
                               " s: give at least one step of the simulator, " + core::rounded_text(step) +
                               " s, and at most 3600 s");
  foresight.request.actions = scene->actions;
  PRESCENE_RETURN_IF_ERROR(foresight.simulator->supports(foresight.request));
  foresight.request.stop.duration = duration;
  foresight.request.stop.stop_at_rest = scene->stop_at_rest;
  foresight.request.stop.world_radius = belief::world_radius(*scene);
  foresight.request.sample_interval = judging_interval(*scene, *foresight.simulator);
  foresight.variables = simulation::variables_of(scene, scene->outcomes, scene->exclusive_outcomes);
  const std::size_t objects = scene->objects.size();
  foresight.scene = std::move(scene);

  const std::size_t of_run = simulation::bytes_of_run(foresight.request, objects);
  if (of_run > context.most_bytes / 4)
    return core::resource_exhausted("the states of one instance would take " + std::to_string(of_run >> 20) +
                                    " MiB: ask for a shorter duration");
  const std::size_t of_record =
      kRecordBytes + objects * sizeof(belief::ObjectState) + (detail.keep_contacts ? kContactsBytes : 0);
  const std::size_t most_instances = std::max<std::size_t>(1, context.most_bytes / 2 / of_record);
  if (effort.exact_instances && static_cast<std::size_t>(*effort.exact_instances) > most_instances)
    return core::resource_exhausted("effort.exact_instances: " + std::to_string(*effort.exact_instances) +
                                    " instances do not fit into the memory for a question: ask for at most " +
                                    std::to_string(most_instances));

  const core::Cancellation until = end_of_simulating(context);

  simulation::EstimatorOptions options;
  options.tolerance = effort.tolerance;
  options.confidence = effort.confidence;
  options.max_instances = static_cast<int>(std::min(static_cast<std::size_t>(effort.max_instances), most_instances));
  options.bytes_of_runs = std::min(options.bytes_of_runs, context.most_bytes / 4);
  options.max_seconds = effort.max_seconds;
  options.exact_instances = effort.exact_instances;
  options.keep_contacts = detail.keep_contacts;
  if (foresight.variables.empty()) options.min_instances = kUnaskedInstances;
  if (!detail.to_rest) foresight.certifier = certifier_of(foresight, duration, context);
  options.certifier = foresight.certifier.get();
  if (detail.so_far)
    options.on_look = [&](const simulation::OutcomeEstimate& so_far) { detail.so_far(foresight, so_far); };
  foresight.estimate =
      simulation::estimate_outcomes(*foresight.simulator, prior.starts, foresight.variables, foresight.request,
                                    prior.stream, options, *context.pool, &until, context.progress);
  if (foresight.estimate.instances.empty() && !context.simulate_until && context.cancellation &&
      context.cancellation->requested())
    return core::cancelled("stopped on request before the first simulated instance was finished");
  if (foresight.estimate.instances.empty())
    return core::cancelled(
        "stopped before the first simulated instance was finished: give more time (max_seconds of a question, "
        "--max-seconds), or a shorter duration");
  if (foresight.estimate.failed == static_cast<int>(foresight.estimate.instances.size()))
    return core::invalid_input("every instance failed in the simulator: look at the scene's shapes, masses and speeds");
  return foresight;
}

std::optional<std::size_t> typical_instance(const Foresight& foresight, std::size_t variable,
                                            const std::set<int>& class_indices, std::size_t object) {
  std::vector<std::size_t> members;
  std::vector<belief::Pose> poses;
  for (std::size_t i = 0; i < foresight.estimate.instances.size(); ++i) {
    const simulation::InstanceRecord& record = foresight.estimate.instances[i];
    if (!class_indices.contains(record.classes[variable])) continue;
    members.push_back(i);
    poses.push_back(record.final.objects[object].X_WO);
  }
  const belief::Scene& scene = *foresight.scene;
  const std::optional<std::size_t> middle = medoid(poses, radius_of(scene.model_of(scene.objects[object])));
  if (!middle) return std::nullopt;
  return members[*middle];
}

double interval_told(const Foresight& foresight, double interval) {
  const auto objects = static_cast<double>(std::max<std::size_t>(1, foresight.scene->objects.size()));
  return std::max(interval, foresight.request.stop.duration * objects / kMostStatesTold);
}

std::optional<belief::Trajectory> run_again(const Foresight& foresight, const Prior& prior, std::size_t instance,
                                            const QueryContext& context) {
  simulation::RunRequest request = foresight.request;
  request.sample_interval = interval_told(foresight, kTimelineInterval);
  belief::Trajectory run = simulation::run_instance(*foresight.simulator, prior.starts, foresight.estimate, instance,
                                                    request, prior.stream, *context.pool, context.cancellation);
  if (run.end == belief::TrajectoryEnd::kCancelled) return std::nullopt;
  return run;
}

// The order of variables is that of simulation::variables_of.
std::optional<std::size_t> variable_about(const belief::Scene& scene, const std::string& object) {
  for (std::size_t g = 0; g < scene.exclusive_outcomes.size(); ++g)
    for (const belief::Outcome& outcome : scene.exclusive_outcomes[g].outcomes)
      if (outcome.object == object) return g;
  for (std::size_t i = 0; i < scene.outcomes.size(); ++i)
    if (scene.outcomes[i].object == object) return scene.exclusive_outcomes.size() + i;
  return std::nullopt;
}

const std::string& name_of(const simulation::Variable& variable) {
  return variable.name.empty() ? variable.classes.front() : variable.name;
}

std::size_t reported_classes(const simulation::Variable& variable) {
  return variable.name.empty() ? 1 : variable.classes.size();
}

}  // namespace prescene::queries
