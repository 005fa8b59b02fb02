// SPDX-License-Identifier: Apache-2.0
// What one should know before trusting the numbers, in sentences.
#include <algorithm>
#include <cmath>
#include <set>

#include "model_doubts.h"
#include "prescene/belief/body_names.h"
#include "prescene/core/random.h"
#include "prescene/core/text.h"
#include "prior.h"
#include "remarks.h"

namespace prescene::queries {
namespace {

using core::fixed_text;

constexpr double kManyFailed = 0.01;
constexpr std::size_t kMostNamed = 3;
constexpr double kLargeShift = 0.03;  // of a probability: named whatever the interval
// Of the instances. Fewer change no probability by more than the tolerance that is usual.
constexpr double kManyMoving = 0.02;

std::string percent(double share, int decimals = 0) { return fixed_text(100.0 * share, decimals) + " %"; }
std::string points(double shift) { return (shift >= 0.0 ? "+" : "") + fixed_text(100.0 * shift, 1); }

std::string full_name(const std::string& group, const std::string& outcome) {
  return group.empty() ? outcome : group + " = " + outcome;
}

/// The variant of a kind that shifts an outcome most, of those that surely shift it.
struct Worst {
  const belief::ModelError::Shift* shift = nullptr;
  std::string what;
};

Worst worst_for(const belief::ModelError& error, belief::ModelError::Kind kind,
                const belief::OutcomeProbability& outcome, double wider) {
  Worst worst;
  for (const belief::ModelError::Variant& variant : error.variants) {
    if (variant.kind != kind) continue;
    for (const belief::ModelError::Shift& shift : variant.shifts) {
      const bool sure = std::abs(shift.shift) > wider * 0.5 * (shift.high - shift.low);
      if (!sure || shift.outcome != outcome.name || shift.group != outcome.group) continue;
      if (worst.shift && std::abs(shift.shift) <= std::abs(worst.shift->shift)) continue;
      worst = {&shift, variant.what};
    }
  }
  return worst;
}

/// "upright (interval +-1.2 points; half the step shifts it by ...); ...": those that shift beyond their interval or
/// by 3 points, the farthest first; empty if none.
std::string large_shifts(const belief::PredictAnswer& answer, belief::ModelError::Kind kind, double wider) {
  struct Narrow {
    double excess;
    std::string text;
  };
  std::vector<Narrow> narrow;
  for (const belief::OutcomeProbability& outcome : answer.outcomes) {
    const double half = 0.5 * (outcome.high - outcome.low);
    const Worst worst = worst_for(*answer.model_error, kind, outcome, wider);
    if (!worst.shift || std::abs(worst.shift->shift) <= std::min(half, kLargeShift)) continue;
    narrow.push_back({std::abs(worst.shift->shift) - half,
                      full_name(outcome.group, outcome.name) + " (interval +-" + fixed_text(100.0 * half, 1) +
                          " points; " + worst.what + " shifts it by " + points(worst.shift->shift) + ", " +
                          points(worst.shift->low) + " to " + points(worst.shift->high) + ")"});
  }
  std::stable_sort(narrow.begin(), narrow.end(), [](const Narrow& a, const Narrow& b) { return a.excess > b.excess; });
  std::string text;
  for (std::size_t i = 0; i < std::min(kMostNamed, narrow.size()); ++i) text += (i > 0 ? "; " : "") + narrow[i].text;
  if (narrow.size() > kMostNamed) text += "; and " + std::to_string(narrow.size() - kMostNamed) + " more";
  return text;
}

void remark_on_model(const belief::PredictAnswer& answer, double confidence, std::vector<std::string>& remarks) {
  using ErrorKind = belief::ModelError::Kind;
  const belief::ModelError& error = *answer.model_error;
  const std::string steps = large_shifts(answer, ErrorKind::kStep, widening(error, ErrorKind::kStep, confidence));
  if (!steps.empty())
    remarks.push_back(
        "The model's step: the intervals say what more instances would change, not what the simulator itself is wrong "
        "by: " +
        steps + ".");
  const std::string priors = large_shifts(answer, ErrorKind::kPrior, widening(error, ErrorKind::kPrior, confidence));
  if (!priors.empty())
    remarks.push_back(
        "What the scene says is not known: the probabilities are taken over all of its values; with one of them known "
        "they would be others: " +
        priors + ".");
  const bool any_prior =
      std::any_of(error.variants.begin(), error.variants.end(),
                  [](const belief::ModelError::Variant& variant) { return variant.kind == ErrorKind::kPrior; });
  std::string small = steps.empty() ? "neither half nor double step" : "";
  if (any_prior && priors.empty())
    small += (small.empty() ? "no" : " and no") + std::string(" end of what the scene says is not known");
  if (small.empty()) return;
  double found = 0.0;
  for (const belief::ModelError::Variant& variant : error.variants) {
    if (!(variant.kind == ErrorKind::kStep ? steps : priors).empty()) continue;
    const double wider = widening(error, variant.kind, confidence);
    for (const belief::ModelError::Shift& shift : variant.shifts)
      found = std::max(found, findable(shift, wider, confidence));
  }
  remarks.push_back(
      "Model error: " + small +
      " was found to shift a probability by 3 points or by more than the half width of its interval; with " +
      std::to_string(error.instances) + (error.instances == 1 ? " instance" : " instances") + ", a shift of " +
      fixed_text(100.0 * found, 1) + " points is found in nine cases of ten.");
}

void remark_on_instances(const belief::Basis& basis, std::vector<std::string>& remarks) {
  const double failed = static_cast<double>(basis.failed_instances) / std::max(1, basis.instances);
  if (basis.failed_instances > 0) {
    std::string text = std::to_string(basis.failed_instances) + " of " + std::to_string(basis.instances) +
                       " instances failed in the simulator. They count for no outcome, and their share widens every "
                       "interval.";
    if (failed > kManyFailed)
      text += " That is more than 1 %: do not rely on this answer; look at the scene's shapes, masses and speeds.";
    remarks.push_back(std::move(text));
  }
  if (basis.overlapping_share > 0.0)
    remarks.push_back("In " + percent(basis.overlapping_share, 1) +
                      " of the instances objects overlapped, at the start or when let go, by up to " +
                      fixed_text(1000.0 * basis.deepest_overlap, 0) +
                      " mm. They are parted gently; what comes of it is doubtful.");
  if (basis.crowded_instances > 0)
    remarks.push_back("In " + std::to_string(basis.crowded_instances) + " of " + std::to_string(basis.instances) +
                      " instances an object had more contacts in a step than there is room for: " +
                      std::to_string(basis.dropped_contacts) +
                      " were left out. Give it fewer parts, or simulate with '--stepper bullet'.");
  if (basis.certificates.switched_off)
    remarks.push_back(
        "Certificates ended too many instances with another outcome than running on: all were run to "
        "rest after all.");
}

void remark_on_tolerance(const belief::Basis& basis, const belief::Effort& effort, std::vector<std::string>& remarks) {
  if (!basis.converged && basis.stopped != "exact")
    remarks.push_back("Not every interval reached +-" + core::rounded_text(effort.tolerance) + ": " +
                      (basis.stopped == "time_limit"  ? "the time ran out"
                       : basis.stopped == "cancelled" ? "it was stopped"
                                                      : "the most instances were run") +
                      ".");
}

/// By object of the scene: whether where it is, or that it rests, at the end is what an outcome asks for.
std::vector<bool> judged_at_end(const belief::Scene& scene) {
  std::vector<bool> judged(scene.objects.size());
  const auto note = [&](const std::string& name) {
    if (const std::optional<int> object = belief::find_object(scene, name))
      judged[static_cast<std::size_t>(*object)] = true;
  };
  const auto look_at = [&](const belief::Outcome& outcome) {
    for (const belief::Condition& condition : belief::all_conditions(outcome)) {
      if (condition.when != belief::When::kAtEnd || std::holds_alternative<belief::Touched>(condition.predicate) ||
          std::holds_alternative<belief::StillMoving>(condition.predicate))
        continue;
      note(outcome.object);
      if (const auto* resting = std::get_if<belief::RestingOn>(&condition.predicate)) note(resting->support);
    }
  };
  for (const belief::ExclusiveOutcomes& group : scene.exclusive_outcomes)
    for (const belief::Outcome& outcome : group.outcomes) look_at(outcome);
  for (const belief::Outcome& outcome : scene.outcomes) look_at(outcome);
  return judged;
}

/// "ends: other 7.0 %, falls 6.3 %": shares of the classes of a group, the largest first.
std::string class_shares(const belief::ExclusiveOutcomes& group, const std::vector<double>& shares) {
  std::vector<std::size_t> order;
  for (std::size_t c = 0; c < shares.size(); ++c)
    if (shares[c] > 0.0) order.push_back(c);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return shares[a] > shares[b]; });
  std::string text = group.name + ":";
  for (std::size_t i = 0; i < std::min(kMostNamed, order.size()); ++i)
    text += (i > 0 ? ", " : " ") + (order[i] < group.outcomes.size() ? group.outcomes[order[i]].name : "other") + " " +
            percent(shares[order[i]], 1);
  return text;
}

/// Held by no grip that may slip, when the action comes.
bool is_held_fast(const belief::Scene& scene, const belief::Action& when, bool held) {
  bool fast = held;
  for (const belief::Action& action : scene.actions) {
    if (&action == &when) break;
    const auto* grasp = std::get_if<belief::Grasp>(&action.what);
    if (grasp != nullptr && grasp->object == belief::object_of(when)) fast = !grasp->grip;
  }
  return held && fast;
}

}  // namespace

void remark_on_actions(const belief::Scene& scene, double duration, std::vector<std::string>& remarks) {
  std::set<std::string> held;
  for (const belief::SceneObject& object : scene.objects)
    if (object.held_by) held.insert(object.name);
  for (const belief::Action& action : scene.actions) {  // they ascend in time
    const std::string object = belief::object_of(action);
    const std::string which = "'" + belief::kind_of(action) + (object.empty() ? "" : " " + object) + "' at " +
                              core::rounded_text(action.time) + " s";
    if (action.time >= duration) {
      remarks.push_back("The action " + which + " is not done: the " + core::rounded_text(duration) +
                        " s that are simulated end before. Ask for a longer duration, or for an earlier action.");
      continue;
    }
    if (belief::is_of_held(action) && !held.contains(object))
      remarks.push_back("Nothing holds '" + object + "' when the action " + which +
                        (std::holds_alternative<belief::Release>(action.what)
                             ? " comes: it changes nothing."
                             : " begins: it is moved as if something that is not seen held it."));
    if (std::holds_alternative<belief::Bump>(action.what) && is_held_fast(scene, action, held.contains(object)))
      remarks.push_back(
          "A hand holds '" + object + "' when the action " + which +
          " comes: it takes the blow, which changes nothing. Grasp it with a grip_force, which may lose it.");
    if (belief::lets_go(action))
      held.erase(object);
    else if (belief::is_of_held(action) || std::holds_alternative<belief::Grasp>(action.what))
      held.insert(object);
  }
}

void remark_on_unfinished_motion(const belief::Scene& scene, const simulation::OutcomeEstimate& estimate,
                                 const simulation::StopRule& stop,
                                 const std::function<bool(const belief::WorldState&)>& settled,
                                 std::vector<std::string>& remarks) {
  const std::vector<bool> judged = judged_at_end(scene);
  std::vector<std::pair<double, std::string>> shares;  // of the instances in which an object moves
  for (const belief::SceneObject& object : scene.objects) shares.emplace_back(0.0, object.name);
  double share = 0.0;
  std::vector<std::vector<double>> classes;  // by group; its variable has the same number (simulation::variables_of)
  for (const belief::ExclusiveOutcomes& group : scene.exclusive_outcomes)
    classes.emplace_back(group.outcomes.size() + 1);
  for (const simulation::InstanceRecord& record : estimate.instances) {
    if (record.failed || record.certified || record.end != belief::TrajectoryEnd::kDuration) continue;
    const auto moves = [&](std::size_t i) {
      const belief::ObjectState& object = record.final.objects[i];
      return judged[i] && object.mode != belief::MotionMode::kHeld && belief::is_moving(object) &&
             object.X_WO.translation.norm() <= stop.world_radius;
    };
    bool any = false;
    for (std::size_t i = 0; i < judged.size(); ++i) any = any || moves(i);
    if (!any || (settled && settled(record.final))) continue;
    share += record.weight;
    for (std::size_t g = 0; g < classes.size(); ++g)
      classes[g][static_cast<std::size_t>(record.classes[g])] += record.weight;
    for (std::size_t i = 0; i < judged.size(); ++i)
      if (moves(i)) shares[i].first += record.weight;
  }
  if (!(share > kManyMoving)) return;
  std::stable_sort(shares.begin(), shares.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  const auto still = std::count_if(shares.begin(), shares.end(), [](const auto& one) { return one.first > 0.0; });
  std::string names;
  for (std::size_t i = 0; i < std::min(kMostNamed, static_cast<std::size_t>(still)); ++i)
    names += (i > 0 ? ", '" : "'") + shares[i].second + "'" + (still > 1 ? " in " + percent(shares[i].first, 1) : "");
  if (static_cast<std::size_t>(still) > kMostNamed)
    names += ", and " + std::to_string(static_cast<std::size_t>(still) - kMostNamed) + " more";
  std::string outcomes;
  for (std::size_t g = 0; g < std::min(kMostNamed, classes.size()); ++g)
    outcomes += (g > 0 ? "; " : " (") + class_shares(scene.exclusive_outcomes[g], classes[g]);
  if (!outcomes.empty()) outcomes += ")";
  remarks.push_back("In " + percent(share, 1) + " of the instances " +
                    (still > 1 ? "things still move (" + names + ")" : names + " still moves") + " when the " +
                    core::rounded_text(stop.duration) + " s that are simulated end" + outcomes +
                    ": outcomes that are judged at the end may come out otherwise later. Give "
                    "a longer 'duration'.");
}

void remark_on_loose_joints(const belief::Belief& belief, std::vector<std::string>& remarks) {
  if (belief.scene->joints.empty()) return;
  belief::Scene scene;
  scene.supports = belief.scene->supports;
  scene.joints = belief.scene->joints;
  for (const belief::ObjectBelief& object : belief.objects)
    if (is_present(object)) scene.objects.emplace_back().name = object.name;
  for (const std::string& name : belief::drop_loose_joints(scene)) {
    const belief::Joint& joint =
        belief.scene->joints[static_cast<std::size_t>(*belief::find_joint(*belief.scene, name))];
    const auto is_there = [&](const std::string& object) {
      return object.empty() || belief::find_object(scene, object) || belief::find_support(scene, object);
    };
    const std::string missing = is_there(joint.parent) ? joint.child : joint.parent;
    remarks.push_back("The joint '" + name + "' is left out: '" + missing + "' is lost" +
                      (missing == joint.parent && is_there(joint.child)
                           ? ". What is said of '" + joint.child + "' takes it for free."
                           : "."));
  }
}

std::vector<std::string> remarks_of(const belief::Basis& basis, const belief::Effort& effort) {
  std::vector<std::string> remarks;
  remark_on_instances(basis, remarks);
  remark_on_tolerance(basis, effort, remarks);
  return remarks;
}

std::vector<std::string> remarks_of(const belief::PredictAnswer& answer, const belief::Effort& effort) {
  std::vector<std::string> remarks;
  remark_on_instances(answer, remarks);
  for (const belief::ChaosCheck& check : answer.chaos) {
    if (!check.chaotic) continue;
    remarks.push_back("'" + check.about + "' is chaotic: of " + std::to_string(check.pairs) + " pairs of starts " +
                      fixed_text(check.displacement, 1) + " standard deviations apart, " + percent(check.changed) +
                      " (" + percent(check.low) + " to " + percent(check.high) +
                      ") end differently. Its interval shrinks no faster than with independent draws: halving it "
                      "takes four times the instances.");
  }
  if (answer.model_error) remark_on_model(answer, effort.confidence, remarks);
  remark_on_tolerance(answer, effort, remarks);
  return remarks;
}

}  // namespace prescene::queries
