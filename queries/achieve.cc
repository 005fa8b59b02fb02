// SPDX-License-Identifier: Apache-2.0
#include "achieve.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "prepared_search.h"
#include "prescene/belief/query_limits.h"
#include "prescene/core/text.h"
#include "prescene/queries/confidence_sequence.h"
#include "prescene/queries/typical_runs.h"

namespace prescene::queries {
namespace {

constexpr std::size_t kMostFailuresLookedAt = 96, kMostReasons = 10;
// What counts as staying where what happens is put into words, m and rad.
constexpr double kStays = 0.01, kStaysTurned = 0.0873;

belief::ActionChoice choice_of(const SearchClaim& claim, const PlannedAction& plan, const ActionTrials& trials,
                               double wanted) {
  belief::ActionChoice choice;
  choice.values = trials.values_at(claim.at);
  if (!claim.low.empty()) {
    choice.low = trials.values_at(claim.low);
    choice.high = trials.values_at(claim.high);
  }
  choice.X_WO = plan.goal(choice.values);
  choice.action = plan.exact(choice.values);
  choice.instances = claim.trials;
  choice.probability = claim.trials > 0 ? static_cast<double>(claim.successes) / claim.trials : 0.0;
  choice.lower = claim.lower;
  choice.upper = claim.upper;
  choice.certified = claim.holds && claim.lower >= wanted;
  return choice;
}

/// What happens where the outcome does not come about, over all the points that were explored.
std::vector<belief::FailureReason> failures_of(const SearchResult& found, PlannedAction& plan, ActionTrials& trials,
                                               const WantedOutcome& wanted, const belief::Scene& scene) {
  std::map<std::pair<std::string, std::string>, double> shares;
  std::vector<Trial> failed;
  for (const SearchPoint& point : found.points) {
    if (!point.explored) continue;
    if (!point.possible) {
      if (const auto obstacle = plan.obstacle(trials.values_at(point.at)))
        shares[{*obstacle, ""}] += 1.0 / found.explored;
    } else if (point.trials > 0 && !point.first_succeeded) {
      failed.push_back({point.at, point.scenario, false});
    }
  }
  const std::size_t all_failed = failed.size();
  failed.resize(std::min(failed.size(), kMostFailuresLookedAt));
  const std::vector<belief::Trajectory> runs = trials.runs_of(failed);
  const auto object = static_cast<int>(*belief::find_object(scene, wanted.outcome.object));
  for (const belief::Trajectory& run : runs) {
    const double share = static_cast<double>(all_failed) / found.explored / static_cast<double>(runs.size());
    if (run.end == belief::TrajectoryEnd::kDiverged)
      shares[{"the simulation became unstable", ""}] += share;
    else
      shares[{wanted.instead(scene, run), event_text(scene, run, object, kStays, kStaysTurned)}] += share;
  }
  std::vector<belief::FailureReason> reasons;
  for (const auto& [what, share] : shares) reasons.push_back({what.first, what.second, share});
  std::stable_sort(reasons.begin(), reasons.end(), [](const auto& a, const auto& b) { return a.share > b.share; });
  if (reasons.size() > kMostReasons) reasons.resize(kMostReasons);
  return reasons;
}

std::string stop_text(const SearchResult& found, const ActionTrials& trials, const QueryContext& context) {
  switch (found.stop) {
    case SearchStop::kDone:
      return found.first >= 0 ? "converged" : "not_found";
    case SearchStop::kMaxTrials:
      return "max_instances";
    case SearchStop::kExact:
      return "exact";
    case SearchStop::kStopped:
      return trials.cancelled() && context.cancellation && context.cancellation->requested() ? "cancelled"
                                                                                             : "time_limit";
  }
  return "unknown";
}

void remark_on(const SearchResult& found, const belief::AchieveQuery& query, belief::AchieveAnswer& answer) {
  const std::string percent = core::rounded_text(100.0 * query.probability) + " %";
  if (!answer.found) {
    std::string text =
        "No choice was found that brings '" + answer.outcome + "' about with a probability of " + percent + " or more";
    text += found.nearest ? ". The best that was found is not certified: its probability is given with its interval."
                          : ": nothing could be tried.";
    answer.remarks.push_back(text);
  }
  if (answer.found && query.survey && !found.box)
    answer.remarks.push_back(
        "No neighbourhood was certified: small changes of the best choice may bring the probability below " + percent +
        ", or the work ended before that was known.");
  if (found.explored > 0 && found.explored == found.explored_impossible)
    answer.remarks.push_back("Something is in the way wherever it was tried: give other ranges.");
  if (answer.anywhere.low > query.probability)
    answer.remarks.push_back("The parameters hardly matter: the outcome comes about almost wherever they are.");
  if (answer.overlapping_share > 0.01)
    answer.remarks.push_back("In " + core::fixed_text(100.0 * answer.overlapping_share, 1) +
                             " % of the instances objects overlapped by more than 2 mm (" +
                             core::fixed_text(1e3 * answer.deepest_overlap, 1) +
                             " mm at most) when they began or were let go; they are parted gently.");
  if (answer.failed_instances > 0)
    answer.remarks.push_back(std::to_string(answer.failed_instances) +
                             " simulated instances became unstable; they count as failures.");
  if (answer.dropped_contacts > 0)
    answer.remarks.push_back("In " + std::to_string(answer.crowded_instances) +
                             " instances steps had more contacts than there is room for.");
  if (answer.stopped == "max_instances" || answer.stopped == "time_limit" || answer.stopped == "cancelled")
    answer.remarks.push_back("The work ended before all of the answer was worked out (" + answer.stopped +
                             "): give more, or fewer free parameters.");
}

/// All of an answer that is known in the middle of the search, too, but the interval of `anywhere`.
void describe(const SearchResult& found, const PreparedSearch& search, const belief::AchieveQuery& query,
              belief::AchieveAnswer& answer) {
  const PlannedAction& plan = *search.plan;
  const ActionTrials& trials = *search.trials;
  static_cast<belief::Basis&>(answer) = trials.basis();
  answer.outcome = search.wanted.name;
  answer.action = query.action;
  answer.object = plan.object();
  answer.support = plan.support();
  answer.wanted = query.probability;
  answer.confidence = query.effort.confidence;
  answer.found = found.best >= 0;
  for (std::size_t i = 0; i < plan.free().size(); ++i) {
    const FreeParameter& free = plan.free()[i];
    belief::SearchedParameter& parameter = answer.parameters.emplace_back();
    parameter.name = free.schema.name;
    parameter.unit = free.schema.unit;
    parameter.low = free.low;
    parameter.high = free.high;
    if (i >= found.profiles.size()) continue;
    parameter.profile = found.profiles[i];
    parameter.fails_alone = found.fails_alone[i];
  }
  for (const SearchClaim& claim : found.claims)
    answer.choices.push_back(choice_of(claim, plan, trials, query.probability));
  if (answer.found)
    answer.best = answer.choices[static_cast<std::size_t>(found.best)];
  else if (found.nearest)
    answer.best = choice_of(*found.nearest, plan, trials, query.probability);
  if (found.box) answer.robust = choice_of(*found.box, plan, trials, query.probability);
  for (const SearchLeader& leader : found.leaders) {
    belief::ActionCandidate& candidate = answer.candidates.emplace_back();
    candidate.values = trials.values_at(leader.at);
    candidate.X_WO = plan.goal(candidate.values);
    candidate.expected = leader.merit;
    candidate.instances = leader.trials;
  }
  answer.anywhere.name = search.wanted.name;
  if (found.explored > 0) {
    answer.anywhere.probability = static_cast<double>(found.explored_successes) / found.explored;
    answer.impossible = static_cast<double>(found.explored_impossible) / found.explored;
  }
  answer.search_instances = found.search_trials;
  answer.attempts = found.attempts;
  answer.step = search.simulator->step_size();
  const simulation::StepperUse stepper = search.simulator->stepper();
  answer.stepper = stepper.name;
  answer.not_lockstep = stepper.not_lockstep;
}

}  // namespace

core::Result<std::unique_ptr<PreparedSearch>> prepare_search(const Prior& prior, const belief::AchieveQuery& query,
                                                             const QueryContext& context) {
  if (!context.make_simulator) return core::unavailable("no simulator: this service was set up without one");
  if (prior.scene->objects.empty()) return core::not_found("there is no object that something could be done with");
  PRESCENE_RETURN_IF_ERROR(belief::find_action_schema(query.action).status().at("action"));
  auto search = std::make_unique<PreparedSearch>();
  PRESCENE_TRY(search->wanted, find_wanted(*prior.scene, query, prior.left_out));
  const WantedOutcome& wanted = search->wanted;
  PRESCENE_TRY(search->plan, plan_action(prior, query, wanted.outcome, *context.pool));
  PlannedAction& plan = *search->plan;
  if (const auto absent = named_absent(wanted, plan.absent()))
    return core::invalid_input("outcome '" + wanted.name + "' can't be decided: it is about '" + *absent +
                               "', which takes no part any more once the object is placed");

  // The middle of the ranges stands for all choices where kinds of actions count.
  std::vector<double> middle;
  for (const FreeParameter& parameter : plan.free()) middle.push_back(parameter.value_of(0.5));
  const std::vector<double> no_noise(static_cast<std::size_t>(plan.noise_dimensions()), 0.5);
  belief::WorldState likeliest = prior.likeliest;
  std::vector<belief::Action> actions = plan.begin(middle, no_noise, likeliest);
  std::stable_sort(actions.begin(), actions.end(),
                   [](const belief::Action& a, const belief::Action& b) { return a.time < b.time; });
  std::vector<belief::ExclusiveOutcomes> groups;
  std::vector<belief::Outcome> outcomes;
  if (wanted.group)
    groups.push_back(*wanted.group);
  else
    outcomes.push_back(wanted.outcome);
  PRESCENE_TRY(search->scene, with_question(*plan.scene(), std::move(actions), std::move(outcomes), std::move(groups)));
  PRESCENE_TRY(search->simulator, context.make_simulator(*search->scene, 1.0));
  const double duration = query.duration.value_or(search->scene->duration);
  const double step = search->simulator->step_size();
  if (duration < step)
    return core::invalid_input("a duration of " + core::rounded_text(duration) +
                               " s: give at least one step of the simulator, " + core::rounded_text(step) + " s");
  simulation::RunRequest request;
  request.actions = search->scene->actions;
  PRESCENE_RETURN_IF_ERROR(search->simulator->supports(request));

  SearchOptions& options = search->options;
  for (const FreeParameter& parameter : plan.free()) options.periodic.push_back(parameter.periodic());
  options.wanted = query.probability;
  options.confidence = query.effort.confidence;
  options.max_trials = query.effort.max_instances;
  options.exact_trials = query.effort.exact_instances;
  options.survey = query.survey;
  options.net_seed = prior.stream.for_purpose(core::Purpose::kSobolScramble).next_u64();
  search->trials = std::make_unique<ActionTrials>(prior, plan, wanted, search->scene, *search->simulator, query,
                                                  context, duration, options.net_seed);
  return search;
}

core::Result<belief::AchieveAnswer> achieve(const Prior& prior, const belief::AchieveQuery& query,
                                            const QueryContext& context,
                                            const SoFarSink<belief::AchieveAnswer>& so_far) {
  const core::Stopwatch watch;
  const double cpu_before = core::process_cpu_seconds();
  PRESCENE_TRY(const auto prepared, prepare_search(prior, query, context));
  const WantedOutcome& wanted = prepared->wanted;
  PlannedAction& plan = *prepared->plan;
  ActionTrials& trials = *prepared->trials;
  const SearchOptions& options = prepared->options;

  belief::AchieveAnswer answer;
  const auto on_claim = [&](const SearchClaim& /*claim*/) {
    if (answer.first_certified_instances > 0) return;
    answer.first_certified_instances = trials.basis().instances;
    answer.first_certified_simulated = trials.basis().simulated_seconds;
    answer.first_certified_seconds = watch.seconds();
  };
  const auto on_round = [&](const SearchResult& known) {
    belief::AchieveAnswer partial = answer;
    describe(known, *prepared, query, partial);
    // May be looked at at any time, as those of the choices. Approximate, as is the interval of the answer: both
    // suppose independent draws, and the explored points are of a scrambled Sobol net.
    const ShareInterval anywhere =
        confidence_sequence(known.explored_successes, known.explored, 1.0 - query.effort.confidence, {});
    partial.anywhere.low = anywhere.low;
    partial.anywhere.high = anywhere.high;
    partial.wall_seconds = watch.seconds();
    so_far(std::move(partial));
  };
  const SearchResult found = search_parameters(trials, options, prior.stream, on_claim,
                                               so_far ? std::function<void(const SearchResult&)>(on_round) : nullptr);
  if (trials.basis().instances == 0 && found.stop == SearchStop::kStopped)
    return core::cancelled(
        "stopped before the first simulated instance was finished: give more time (max_seconds of a question, "
        "--max-seconds)");

  describe(found, *prepared, query, answer);
  if (found.map_x >= 0) {
    answer.map = belief::ActionMap{answer.parameters[static_cast<std::size_t>(found.map_x)].name,
                                   answer.parameters[static_cast<std::size_t>(found.map_y)].name,
                                   options.map_cells,
                                   options.map_cells,
                                   found.map,
                                   options.map_trials};
  }
  if (query.survey) answer.failures = failures_of(found, plan, trials, wanted, *prepared->scene);
  const ShareInterval anywhere =
      clopper_pearson(found.explored_successes, found.explored, 1.0 - query.effort.confidence);
  answer.anywhere.low = anywhere.low;
  answer.anywhere.high = anywhere.high;
  answer.converged = answer.found && found.stop == SearchStop::kDone;
  answer.stopped = stop_text(found, trials, context);
  answer.remarks = plan.remarks();
  remark_on(found, query, answer);
  answer.wall_seconds = watch.seconds();
  answer.cpu_seconds = core::process_cpu_seconds() - cpu_before;
  return answer;
}

}  // namespace prescene::queries
