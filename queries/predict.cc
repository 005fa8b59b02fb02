// SPDX-License-Identifier: Apache-2.0
// State anticipation: X*_t+1 ~ P(X_t+1 | U_t, X_t).
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <utility>

#include "basis.h"
#include "contact_forecast.h"
#include "deciding_inputs.h"
#include "flight_forecast.h"
#include "model_doubts.h"
#include "predict.h"
#include "prescene/core/text.h"
#include "prescene/queries/final_poses.h"
#include "remarks.h"

namespace prescene::queries {
namespace {

constexpr std::size_t kMostTypicalRuns = 12;
// Densities are made of the first so many instances, which are a net as well: more show no more, and take long.
constexpr std::size_t kMostKernels = 8192;

/// Indices of the objects that outcomes judge or actions move; all when there are none.
std::vector<std::size_t> objects_asked_about(const belief::Scene& scene) {
  std::set<std::string> names;
  for (const belief::ExclusiveOutcomes& group : scene.exclusive_outcomes)
    for (const belief::Outcome& outcome : group.outcomes) names.insert(outcome.object);
  for (const belief::Outcome& outcome : scene.outcomes) names.insert(outcome.object);
  for (const belief::Action& action : scene.actions) names.insert(belief::object_of(action));
  names.erase("");
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (names.empty() || names.contains(scene.objects[i].name)) indices.push_back(i);
  return indices;
}

/// Of the components of the start among these instances.
std::map<int, double> shares_of(std::span<const simulation::InstanceRecord> instances) {
  std::map<int, double> shares;
  for (const simulation::InstanceRecord& record : instances) shares[record.component] += record.weight;
  return shares;
}

belief::FinalPoses final_poses_of(const Foresight& foresight, std::size_t object, core::ThreadPool& pool) {
  const belief::Scene& scene = *foresight.scene;
  const belief::SceneObject& known = scene.objects[object];
  const std::optional<std::size_t> variable = variable_about(scene, known.name);
  const std::span all(foresight.estimate.instances);
  const std::span looked_at = all.first(std::min(kMostKernels, all.size()));
  const std::map<int, double> shares = shares_of(all), looked_at_shares = shares_of(looked_at);
  std::vector<FinalSample> samples;
  double mass = 0.0;
  for (const simulation::InstanceRecord& record : looked_at) {
    if (record.failed) continue;
    double weight = record.weight;
    if (looked_at.size() < all.size()) weight *= shares.at(record.component) / looked_at_shares.at(record.component);
    samples.push_back({record.final.objects[object].X_WO, weight, variable ? record.classes[*variable] : 0});
    mass += weight;
  }
  if (samples.empty()) return {};
  if (foresight.estimate.failed > 0 || looked_at.size() < all.size())
    for (FinalSample& sample : samples) sample.weight /= mass;
  const std::vector<std::string> nothing_asked{""};
  const std::vector<std::string>& names = variable ? foresight.variables[*variable].classes : nothing_asked;
  return final_poses(known.name, samples, names, scene.model_of(known).symmetry, {}, pool);
}

/// Angles with weights, rad: each is moved by whole turns to within half a turn of their mean direction, so that those
/// on both sides of 180 degrees are near each other.
void unwrap_about_mean_direction(std::vector<std::pair<double, double>>& angles) {
  double sine = 0.0, cosine = 0.0;
  for (const auto& [angle, weight] : angles) {
    sine += weight * std::sin(angle);
    cosine += weight * std::cos(angle);
  }
  const double middle = std::atan2(sine, cosine);
  for (auto& [angle, weight] : angles) angle = middle + std::remainder(angle - middle, 2.0 * std::numbers::pi);
}

/// Of the joints at the end, over all instances that did not fail.
std::vector<belief::JointForecast> joints_at_end(const Foresight& foresight) {
  const belief::Scene& scene = *foresight.scene;
  if (scene.joints.empty()) return {};
  std::vector<std::vector<std::pair<double, double>>> positions(scene.joints.size());  // with weights
  for (const simulation::InstanceRecord& record : foresight.estimate.instances) {
    if (record.failed) continue;
    const std::vector<belief::JointState> states = belief::joint_states(scene, record.final);
    for (std::size_t j = 0; j < states.size(); ++j) positions[j].emplace_back(states[j].position, record.weight);
  }
  std::vector<belief::JointForecast> forecasts;
  for (std::size_t j = 0; j < scene.joints.size(); ++j) {
    if (scene.joints[j].type == belief::JointType::kHinge && std::isinf(scene.joints[j].low))
      unwrap_about_mean_direction(positions[j]);
    std::sort(positions[j].begin(), positions[j].end());
    double mass = 0.0, first = 0.0, second = 0.0;
    for (const auto& [position, weight] : positions[j]) {
      mass += weight;
      first += weight * position;
      second += weight * position * position;
    }
    if (!(mass > 0.0)) continue;
    belief::JointForecast& forecast = forecasts.emplace_back();
    forecast.joint = scene.joints[j].name;
    forecast.type = scene.joints[j].type;
    forecast.mean = first / mass;
    forecast.standard_deviation = std::sqrt(std::max(0.0, second / mass - forecast.mean * forecast.mean));
    const auto quantile = [&](double share) {
      double reached = 0.0;
      for (const auto& [position, weight] : positions[j])
        if ((reached += weight) >= share * mass) return position;
      return positions[j].back().first;
    };
    forecast.low = quantile(0.05);
    forecast.middle = quantile(0.5);
    forecast.high = quantile(0.95);
  }
  return forecasts;
}

std::vector<belief::OutcomeProbability> probabilities_of(const Foresight& foresight,
                                                         const simulation::OutcomeEstimate& estimate) {
  std::vector<belief::OutcomeProbability> all;
  for (std::size_t v = 0; v < foresight.variables.size(); ++v) {
    const simulation::Variable& variable = foresight.variables[v];
    for (std::size_t c = 0; c < reported_classes(variable); ++c) {
      const simulation::ClassEstimate& one = estimate.variables[v].classes[c];
      all.push_back({variable.classes[c], variable.name, one.probability, one.low, one.high});
    }
  }
  return all;
}

/// One run for each outcome that happened, the likeliest first.
std::vector<belief::TypicalRun> typical_runs_of(const Foresight& foresight, const Prior& prior,
                                                const QueryContext& context, bool& complete) {
  struct Candidate {
    double share;
    std::size_t variable;
    int which;
  };
  const belief::Scene& scene = *foresight.scene;
  std::vector<Candidate> candidates;
  for (std::size_t v = 0; v < foresight.variables.size(); ++v) {
    for (std::size_t c = 0; c < reported_classes(foresight.variables[v]); ++c) {
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
    if (!trajectory) {  // stopped: the probabilities are there, which matter most
      complete = false;
      break;
    }
    belief::TypicalRun& run = runs.emplace_back();
    run.outcome = foresight.variables[candidate.variable].classes[static_cast<std::size_t>(candidate.which)];
    run.group = foresight.variables[candidate.variable].name;
    run.share = candidate.share;
    run.trajectory = *std::move(trajectory);
    run.timeline = belief::timeline_of(scene, run.trajectory);
  }
  return runs;
}

/// Not of what can't change the outcomes any more, were it simulated as long again: what has fallen and rolls on.
void remark_on_motion_at_end(const Foresight& foresight, const QueryContext& context,
                             std::vector<std::string>& remarks) {
  const double longer = foresight.request.stop.duration;
  std::optional<std::unique_ptr<const simulation::Certifier>> certifier;  // made when something moves
  const auto settled = [&](const belief::WorldState& state) {
    if (!certifier) certifier = certifier_of(foresight, longer + longer, context);
    return *certifier && (*certifier)->ends(state, longer);
  };
  remark_on_unfinished_motion(*foresight.scene, foresight.estimate, foresight.request.stop, settled, remarks);
}

std::vector<belief::ProbabilityStage> history_of(const Foresight& foresight) {
  std::vector<belief::ProbabilityStage> history;
  for (const simulation::EstimateStage& stage : foresight.estimate.history) {
    belief::ProbabilityStage& reported = history.emplace_back();
    reported.instances = stage.instances;
    for (std::size_t v = 0; v < foresight.variables.size(); ++v)
      for (std::size_t c = 0; c < reported_classes(foresight.variables[v]); ++c) {
        const simulation::ClassEstimate& one = stage.variables[v].classes[c];
        reported.outcomes.push_back({one.probability, one.low, one.high});
      }
  }
  return history;
}

}  // namespace

core::Result<belief::PredictAnswer> predict(const Prior& prior, const belief::PredictQuery& query,
                                            const QueryContext& context,
                                            const SoFarSink<belief::PredictAnswer>& so_far) {
  const belief::Scene& own = *prior.scene;
  const belief::PredictDetail& wanted = query.detail;
  const bool use_own_outcomes = query.outcomes.empty() && query.exclusive_outcomes.empty();
  PRESCENE_TRY(auto scene, with_question(own, query.actions.empty() && !prior.seen ? own.actions : query.actions,
                                         use_own_outcomes ? own.outcomes : query.outcomes,
                                         use_own_outcomes ? own.exclusive_outcomes : query.exclusive_outcomes));
  if (scene->objects.empty()) return core::not_found("there is no object to predict");
  ForesightDetail detail;
  detail.to_rest = wanted.final_poses || wanted.typical_runs || wanted.contacts || wanted.paths > 0;
  detail.keep_contacts = wanted.contacts;
  if (so_far)
    detail.so_far = [&](const Foresight& foresight, const simulation::OutcomeEstimate& estimate) {
      belief::PredictAnswer answer;
      account_so_far(foresight, estimate, answer);
      answer.outcomes = probabilities_of(foresight, estimate);
      if (use_own_outcomes) answer.left_out = prior.left_out;
      so_far(std::move(answer));
    };
  PRESCENE_TRY(const Foresight foresight,
               foresee(prior, std::move(scene), query.duration.value_or(own.duration), query.effort, context, detail));

  belief::PredictAnswer answer;
  account(foresight, answer);
  answer.outcomes = probabilities_of(foresight, foresight.estimate);
  answer.history = history_of(foresight);
  answer.joints = joints_at_end(foresight);
  const std::vector<std::size_t> objects = objects_asked_about(*foresight.scene);
  // What was not worked out when the time ran out or somebody stopped it.
  std::vector<std::string> missing;
  const auto abandoned = [&] { return context.abandoned && context.abandoned->requested(); };
  const auto stopped = [&] { return abandoned() || (context.cancellation && context.cancellation->requested()); };
  const auto work_out = [&](bool asked, const char* part, const auto& work) {
    if (asked && (abandoned() || !work())) missing.emplace_back(part);
  };
  work_out(wanted.final_poses, "final_poses", [&] {
    for (std::size_t object : objects) {
      if (abandoned()) return false;
      belief::FinalPoses poses = final_poses_of(foresight, object, *context.pool);
      if (poses.components.empty()) continue;  // every instance that would be looked at failed
      answer.final_poses.push_back(std::move(poses));
    }
    return true;
  });
  work_out(wanted.typical_runs, "typical_runs", [&] {
    bool complete = true;
    answer.typical_runs = typical_runs_of(foresight, prior, context, complete);
    return complete;
  });
  work_out(wanted.inputs, "inputs", [&] {
    answer.inputs = deciding_inputs(foresight, prior, context);
    return !abandoned();
  });
  work_out(wanted.contacts, "contacts",
           [&] { return forecast_contacts(foresight, query.effort.confidence, context.abandoned, answer); });
  core::Status flight;
  work_out(wanted.contacts, "flight", [&] {
    flight = forecast_flight(foresight, prior, context, answer);
    return answer.flight || !stopped();
  });
  work_out(wanted.paths > 0, "paths", [&] {
    bool complete = true;
    answer.paths = paths_of(foresight, prior, wanted.paths, objects, context, complete);
    return complete;
  });
  work_out(wanted.chaos, "chaos", [&] {
    answer.chaos = check_for_chaos(foresight, prior, query.effort.confidence, context);
    return !answer.chaos.empty() || !stopped();
  });
  core::Status model_status;
  work_out(wanted.model_error, "model_error", [&] {
    auto error = model_error(foresight, prior, query.effort.confidence, context);
    if (!error) {
      model_status = error.status();
      return true;
    }
    answer.model_error = *std::move(error);
    return answer.model_error || !stopped();
  });
  PRESCENE_RETURN_IF_ERROR(model_status);
  if (use_own_outcomes) answer.left_out = prior.left_out;
  answer.remarks = remarks_of(answer, query.effort);
  if (!missing.empty()) answer.remarks.push_back(missing_text(missing));
  remark_on_actions(*foresight.scene, foresight.request.stop.duration, answer.remarks);
  remark_on_motion_at_end(foresight, context, answer.remarks);
  remark_on_leaving(foresight.estimate, foresight.request.stop.world_radius, answer.remarks);
  if (!flight.ok())
    answer.remarks.push_back("How long nothing can touch anything is not known: " + flight.message() + ".");
  remark_on_certainty(foresight.estimate, answer.remarks);
  return answer;
}

}  // namespace prescene::queries
