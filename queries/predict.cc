// SPDX-License-Identifier: Apache-2.0
// State anticipation: X*_t+1 ~ P(X_t+1 | U_t, X_t).
#include <algorithm>
#include <utility>

#include "prescene/queries/final_poses.h"
#include "tasks.h"

namespace prescene::queries {
namespace {

constexpr std::size_t kMostTypicalRuns = 8;

/// The name of the object that an action moves, empty for pushes.
std::string object_of(const belief::Action& action) {
  struct Visitor {
    std::string operator()(const belief::Release& release) const { return release.object; }
    std::string operator()(const belief::Place& place) const { return place.object; }
    std::string operator()(const belief::Push&) const { return {}; }
    std::string operator()(const belief::Pour& pour) const { return pour.container; }
    std::string operator()(const belief::Grasp& grasp) const { return grasp.object; }
    std::string operator()(const belief::Transport& transport) const { return transport.object; }
  };
  return std::visit(Visitor{}, action.what);
}

/// Indices of the objects that outcomes judge or actions move; all when there are none.
std::vector<std::size_t> objects_asked_about(const belief::Scene& scene) {
  std::set<std::string> names;
  for (const belief::ExclusiveOutcomes& group : scene.exclusive_outcomes)
    for (const belief::Outcome& outcome : group.outcomes) names.insert(outcome.object);
  for (const belief::Outcome& outcome : scene.outcomes) names.insert(outcome.object);
  for (const belief::Action& action : scene.actions) names.insert(object_of(action));
  names.erase("");
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (names.empty() || names.contains(scene.objects[i].name)) indices.push_back(i);
  return indices;
}

/// The variable whose classes an object's final poses are told apart by: the first exclusive group about it, else the
/// first outcome about it. The order of variables is that of simulation::variables_of.
std::optional<std::size_t> variable_about(const belief::Scene& scene, const std::string& object) {
  for (std::size_t g = 0; g < scene.exclusive_outcomes.size(); ++g)
    for (const belief::Outcome& outcome : scene.exclusive_outcomes[g].outcomes)
      if (outcome.object == object) return g;
  for (std::size_t i = 0; i < scene.outcomes.size(); ++i)
    if (scene.outcomes[i].object == object) return scene.exclusive_outcomes.size() + i;
  return std::nullopt;
}

belief::FinalPoses final_poses_of(const Foresight& foresight, std::size_t object, core::ThreadPool& pool) {
  const belief::Scene& scene = *foresight.scene;
  const belief::SceneObject& known = scene.objects[object];
  const std::optional<std::size_t> variable = variable_about(scene, known.name);
  std::vector<FinalSample> samples;
  for (const simulation::InstanceRecord& record : foresight.estimate.instances) {
    samples.push_back({record.final.objects[object].X_WO, record.weight, variable ? record.classes[*variable] : 0});
  }
  const std::vector<std::string> nothing_asked{""};
  const std::vector<std::string>& names = variable ? foresight.variables[*variable].classes : nothing_asked;
  return final_poses(known.name, samples, names, scene.model_of(known).symmetry, {}, pool);
}

std::vector<belief::OutcomeProbability> probabilities_of(const Foresight& foresight) {
  std::vector<belief::OutcomeProbability> all;
  for (std::size_t v = 0; v < foresight.variables.size(); ++v) {
    const simulation::Variable& variable = foresight.variables[v];
    // Of a single outcome its opposite is not told: that is the same number again.
    const std::size_t count = variable.name.empty() ? 1 : variable.classes.size();
    for (std::size_t c = 0; c < count; ++c) {
      const simulation::ClassEstimate& one = foresight.estimate.variables[v].classes[c];
      all.push_back({variable.classes[c], variable.name, one.probability, one.low, one.high});
    }
  }
  return all;
}

/// One run for each outcome that happened, the likeliest first.
std::vector<belief::TypicalRun> typical_runs_of(const Foresight& foresight, const Prior& prior,
                                                const QueryContext& context) {
  struct Candidate {
    double share;
    std::size_t variable;
    int which;
  };
  const belief::Scene& scene = *foresight.scene;
  std::vector<Candidate> candidates;
  for (std::size_t v = 0; v < foresight.variables.size(); ++v) {
    const std::size_t count = foresight.variables[v].name.empty() ? 1 : foresight.variables[v].classes.size();
    for (std::size_t c = 0; c < count; ++c) {
      const double share = foresight.estimate.variables[v].classes[c].probability;
      if (share > 0.0) candidates.push_back({share, v, static_cast<int>(c)});
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.share > b.share; });
  if (candidates.size() > kMostTypicalRuns) candidates.resize(kMostTypicalRuns);

  std::vector<belief::TypicalRun> runs;
  for (const Candidate& candidate : candidates) {
    const std::size_t groups = scene.exclusive_outcomes.size();
    const std::string& name = candidate.variable < groups
                                  ? scene.exclusive_outcomes[candidate.variable].outcomes.front().object
                                  : scene.outcomes[candidate.variable - groups].object;
    const std::optional<int> object = belief::find_object(scene, name);
    const std::optional<std::size_t> instance =
        typical_instance(foresight, candidate.variable, {candidate.which}, static_cast<std::size_t>(*object));
    if (!instance) continue;
    std::optional<belief::Trajectory> trajectory = run_again(foresight, prior, *instance, context);
    if (!trajectory) break;  // stopped: the probabilities are there, which matter most
    belief::TypicalRun& run = runs.emplace_back();
    run.outcome = foresight.variables[candidate.variable].classes[static_cast<std::size_t>(candidate.which)];
    run.group = foresight.variables[candidate.variable].name;
    run.share = candidate.share;
    run.trajectory = *std::move(trajectory);
    run.timeline = belief::timeline_of(scene, run.trajectory);
  }
  return runs;
}

}  // namespace

core::Result<belief::PredictAnswer> predict(const Prior& prior, const belief::PredictQuery& query,
                                            const QueryContext& context) {
  const belief::Scene& own = *prior.scene;
  const bool use_own_outcomes = query.outcomes.empty() && query.exclusive_outcomes.empty();
  PRESCENE_TRY(auto scene, with_question(own, query.actions.empty() && !prior.seen ? own.actions : query.actions,
                                         use_own_outcomes ? own.outcomes : query.outcomes,
                                         use_own_outcomes ? own.exclusive_outcomes : query.exclusive_outcomes));
  if (scene->objects.empty()) return core::not_found("there is no object whose future could be told");
  PRESCENE_TRY(const Foresight foresight,
               foresee(prior, std::move(scene), query.duration.value_or(own.duration), query.effort, context));

  belief::PredictAnswer answer;
  answer.outcomes = probabilities_of(foresight);
  for (std::size_t object : objects_asked_about(*foresight.scene))
    answer.final_poses.push_back(final_poses_of(foresight, object, *context.pool));
  answer.typical_runs = typical_runs_of(foresight, prior, context);
  answer.instances = static_cast<int>(foresight.estimate.instances.size());
  answer.simulated_seconds = foresight.estimate.simulated_seconds;
  answer.wall_seconds = foresight.estimate.wall_seconds;
  if (use_own_outcomes) answer.left_out = prior.left_out;
  answer.converged = foresight.estimate.converged;
  return answer;
}

}  // namespace prescene::queries
