// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/queries/typical_runs.h"
#include "tasks.h"

namespace prescene::queries {
namespace {

// States between which "ever" and "always" are not looked at; 20 ms is 4 cm at the speed of a fall from a table's
// height.
constexpr double kJudgingInterval = 0.02;
constexpr double kTimelineInterval = 1.0 / 30.0;
// Where nothing is asked but where things end, as many instances as a heat map of good quality takes.
constexpr int kUnaskedInstances = 256;
constexpr int kMostInstances = 1 << 24;
constexpr double kLongest = 3600.0;  // s

core::Status check_effort(const belief::Effort& effort) {
  if (!(effort.tolerance > 0.0 && effort.tolerance < 1.0))
    return core::invalid_input("effort.tolerance of " + std::to_string(effort.tolerance) +
                               ": give a half width between 0 and 1, like 0.02");
  if (!(effort.confidence > 0.0 && effort.confidence < 1.0))
    return core::invalid_input("effort.confidence of " + std::to_string(effort.confidence) +
                               ": give a probability between 0 and 1, like 0.95");
  if (effort.max_instances < 1 || effort.max_instances > kMostInstances)
    return core::invalid_input("effort.max_instances of " + std::to_string(effort.max_instances) +
                               ": give between 1 and 16777216");
  if (effort.exact_instances && (*effort.exact_instances < 1 || *effort.exact_instances > kMostInstances))
    return core::invalid_input("effort.exact_instances of " + std::to_string(*effort.exact_instances) +
                               ": give between 1 and 16777216");
  if (effort.max_seconds && !(*effort.max_seconds > 0.0))
    return core::invalid_input("effort.max_seconds has to be more than 0");
  return {};
}

bool needs_states_along_the_way(const belief::Scene& scene) {
  const auto needs = [](const belief::Outcome& outcome) { return belief::needs_states_along_the_way(outcome); };
  return std::any_of(scene.outcomes.begin(), scene.outcomes.end(), needs) ||
         std::any_of(scene.exclusive_outcomes.begin(), scene.exclusive_outcomes.end(),
                     [&](const belief::ExclusiveOutcomes& group) {
                       return std::any_of(group.outcomes.begin(), group.outcomes.end(), needs);
                     });
}

}  // namespace

core::Result<Foresight> foresee(const Prior& prior, std::shared_ptr<const belief::Scene> scene, double duration,
                                const belief::Effort& effort, const QueryContext& context,
                                const ForesightDetail& detail) {
  PRESCENE_RETURN_IF_ERROR(check_effort(effort));
  if (!context.make_simulator) return core::unavailable("no simulator: this service was set up without one");

  Foresight foresight;
  PRESCENE_TRY(foresight.simulator, context.make_simulator(*scene, 1.0));
  const double step = foresight.simulator->step_size();
  if (!(duration >= step && duration <= kLongest))
    return core::invalid_input("a duration of " + core::rounded_text(duration) +
                               " s: give at least one step of the simulator, " + core::rounded_text(step) +
                               " s, and at most 3600 s");
  foresight.request.actions = scene->actions;
  PRESCENE_RETURN_IF_ERROR(foresight.simulator->supports(foresight.request));
  foresight.request.stop.duration = duration;
  foresight.request.stop.stop_at_rest = scene->stop_at_rest;
  foresight.request.sample_interval = needs_states_along_the_way(*scene) ? kJudgingInterval : 0.0;
  foresight.variables = simulation::variables_of(scene, scene->outcomes, scene->exclusive_outcomes);
  foresight.scene = std::move(scene);

  simulation::EstimatorOptions options;
  options.tolerance = effort.tolerance;
  options.confidence = effort.confidence;
  options.max_instances = effort.max_instances;
  options.max_seconds = effort.max_seconds;
  options.exact_instances = effort.exact_instances;
  options.keep_contacts = detail.keep_contacts;
  if (foresight.variables.empty()) options.min_instances = kUnaskedInstances;
  if (!detail.to_rest && !foresight.variables.empty())
    foresight.certifier =
        simulation::make_certifier(foresight.scene, foresight.variables, foresight.request,
                                   {.shapes = context.shapes, .edge_rounding = context.edge_rounding});
  options.certifier = foresight.certifier.get();
  foresight.estimate =
      simulation::estimate_outcomes(*foresight.simulator, prior.starts, foresight.variables, foresight.request,
                                    prior.stream, options, *context.pool, context.cancellation, context.progress);
  if (foresight.estimate.instances.empty())
    return core::cancelled(
        "stopped before the first simulated instance was finished: give more time, or a shorter duration");
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

std::optional<belief::Trajectory> run_again(const Foresight& foresight, const Prior& prior, std::size_t instance,
                                            const QueryContext& context) {
  simulation::RunRequest request = foresight.request;
  request.sample_interval = kTimelineInterval;
  belief::Trajectory run = simulation::run_instance(*foresight.simulator, prior.starts, foresight.estimate, instance,
                                                    request, prior.stream, *context.pool, context.cancellation);
  if (run.end == belief::TrajectoryEnd::kCancelled) return std::nullopt;
  return run;
}

}  // namespace prescene::queries
