// SPDX-License-Identifier: Apache-2.0
#include "action_trials.h"

#include <algorithm>
#include <span>
#include <utility>

#include "foresee.h"
#include "prescene/belief/scene_size.h"
#include "prescene/core/check.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "prescene/simulation/own_actions.h"

namespace prescene::queries {
namespace {

constexpr double kNoticedOverlap = 0.002;  // m
// What simulators draw in actions is told apart by the number of the instance: fresh ones have this bit.
constexpr std::uint32_t kFreshNumbers = 1U << 31U;

int most_dimensions(const simulation::StartDistribution& starts) {
  int most = 0;
  for (const simulation::StartComponent& component : starts.components) most = std::max(most, component.dimensions);
  return most;
}

}  // namespace

ActionTrials::ActionTrials(const Prior& prior, PlannedAction& plan, const WantedOutcome& wanted,
                           std::shared_ptr<const belief::Scene> scene, const simulation::Simulator& simulator,
                           const belief::AchieveQuery& query, const QueryContext& context, double duration,
                           std::uint64_t net_seed)
    : prior_(prior),
      plan_(plan),
      wanted_(wanted),
      scene_(std::move(scene)),
      simulator_(simulator),
      query_(query),
      context_(context),
      start_dimensions_(most_dimensions(prior.starts)),
      first_coordinate_(static_cast<int>(plan.free().size())),
      net_(
          std::min(core::SobolNet::kMaxDimensions, first_coordinate_ + 1 + start_dimensions_ + plan.noise_dimensions()),
          net_seed),
      fresh_(prior.stream.for_purpose(core::Purpose::kAction)) {
  request_.actions = scene_->actions;
  request_.stop.duration = duration;
  request_.stop.stop_at_rest = scene_->stop_at_rest;
  request_.stop.world_radius = belief::world_radius(*scene_);
  request_.sample_interval = judging_interval(
      wanted.group ? std::span(wanted.group->outcomes) : std::span<const belief::Outcome>(&wanted.outcome, 1),
      simulator);
}

std::vector<double> ActionTrials::values_at(std::span<const double> point) const {
  std::vector<double> values;
  for (std::size_t i = 0; i < point.size(); ++i) values.push_back(plan_.free()[i].value_of(point[i]));
  return values;
}

bool ActionTrials::enough() const {
  if (context_.cancellation && context_.cancellation->requested()) return true;
  return query_.effort.max_seconds && !query_.effort.exact_instances && watch_.seconds() >= *query_.effort.max_seconds;
}

void ActionTrials::draw(const Trial& trial, belief::WorldState& start, std::vector<belief::Action>& actions) const {
  const auto count = static_cast<std::size_t>(1 + start_dimensions_ + plan_.noise_dimensions());
  std::vector<double> uniforms(count);
  core::RandomStream random = fresh_.at(trial.fresh ? 2 : 3, trial.scenario);
  if (trial.fresh) {
    for (double& uniform : uniforms) uniform = random.uniform();
  } else {
    std::vector<double> coordinates(static_cast<std::size_t>(net_.dimensions()));
    net_.point(trial.scenario, coordinates);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t coordinate = static_cast<std::size_t>(first_coordinate_) + i;
      uniforms[i] = coordinate < coordinates.size() ? coordinates[coordinate] : random.uniform();
    }
  }
  const simulation::StartComponent& component = prior_.starts.chosen_by(uniforms[0]);
  const std::span all(uniforms);
  start = component.draw(all.subspan(1, static_cast<std::size_t>(component.dimensions)));
  actions = plan_.begin(values_at(trial.point), all.subspan(static_cast<std::size_t>(1 + start_dimensions_)), start);
}

bool ActionTrials::simulate(std::span<const Trial> trials, std::vector<belief::Trajectory>& runs) {
  std::vector<belief::WorldState> starts(trials.size());
  std::vector<std::vector<belief::Action>> actions(trials.size());
  std::vector<std::uint32_t> numbers(trials.size());
  context_.pool->for_each_index(trials.size(), [&](std::size_t i) {
    draw(trials[i], starts[i], actions[i]);
    numbers[i] = trials[i].fresh ? kFreshNumbers | trials[i].scenario : trials[i].scenario;
  });
  runs.assign(trials.size(), {});
  const core::Cancellation until = end_of_simulating(context_);
  simulation::RunRequest request = request_;
  request.actions.clear();  // each has its own
  simulation::run_own_actions(simulator_, starts, actions, request, prior_.stream,
                              std::span<const std::uint32_t>(numbers), *context_.pool, runs, &until);
  return std::none_of(runs.begin(), runs.end(),
                      [](const belief::Trajectory& run) { return run.end == belief::TrajectoryEnd::kCancelled; });
}

bool ActionTrials::run(std::span<const Trial> trials, std::span<TrialEnd> ends) {
  const std::size_t of_run = simulation::bytes_of_run(request_, scene_->objects.size());
  const std::size_t together = std::clamp<std::size_t>((std::size_t{128} << 20) / of_run, 1, 1024);
  belief::Basis counted = basis_;
  double overlapping = overlapping_;
  for (std::size_t begin = 0; begin < trials.size(); begin += together) {
    const auto part = trials.subspan(begin, std::min(together, trials.size() - begin));
    std::vector<belief::Trajectory> runs;
    if (!simulate(part, runs)) {
      cancelled_ = true;
      return false;
    }
    std::vector<std::uint8_t> holds(part.size());
    context_.pool->for_each_index(part.size(), [&](std::size_t i) {
      holds[i] = runs[i].end != belief::TrajectoryEnd::kDiverged && wanted_.holds(*scene_, runs[i]);
    });
    for (std::size_t i = 0; i < part.size(); ++i) {
      ends[begin + i] = holds[i] ? TrialEnd::kSucceeds : TrialEnd::kFails;
      const belief::Trajectory& run = runs[i];
      ++counted.instances;
      counted.failed_instances += run.end == belief::TrajectoryEnd::kDiverged;
      counted.simulated_seconds += run.simulated_seconds;
      counted.flown_seconds += run.flown_seconds;
      counted.dropped_contacts += run.dropped_contacts;
      counted.crowded_instances += run.dropped_contacts > 0;
      overlapping += run.deepest_overlap > kNoticedOverlap;
      counted.deepest_overlap = std::max(counted.deepest_overlap, run.deepest_overlap);
    }
  }
  basis_ = std::move(counted);
  overlapping_ = overlapping;
  basis_.overlapping_share = basis_.instances > 0 ? overlapping / basis_.instances : 0.0;
  return true;
}

std::vector<belief::Trajectory> ActionTrials::runs_of(std::span<const Trial> trials) {
  std::vector<belief::Trajectory> runs;
  if (!simulate(trials, runs))
    std::erase_if(runs, [](const belief::Trajectory& run) { return run.end == belief::TrajectoryEnd::kCancelled; });
  return runs;
}

}  // namespace prescene::queries
