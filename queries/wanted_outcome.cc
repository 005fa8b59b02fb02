// SPDX-License-Identifier: Apache-2.0
#include "wanted_outcome.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "prescene/core/spelling.h"
#include "prescene/core/text.h"
#include "prescene/geometry/angles.h"

namespace prescene::queries {
namespace {

using belief::Condition;
using belief::When;
using geometry::Vector3d;

std::string degrees_text(double radians) { return core::rounded_text(geometry::exact_degrees(radians)) + " degrees"; }

struct PredicateText {
  std::string operator()(const belief::InsideVolume& inside) const {
    return inside.whole ? "wholly inside the volume" : "inside the volume";
  }
  std::string operator()(const belief::RestingOn& resting) const { return "resting on " + resting.support; }
  std::string operator()(const belief::UprightWithin& upright) const {
    return "upright within " + degrees_text(upright.max_angle);
  }
  std::string operator()(const belief::FaceUp&) const { return "with that face up"; }
  std::string operator()(const belief::BelowHeight& below) const {
    return "below " + core::rounded_text(below.height) + " m";
  }
  std::string operator()(const belief::MovedMoreThan& moved) const {
    return "moved more than " + core::rounded_text(moved.distance) + " m";
  }
  std::string operator()(const belief::TurnedMoreThan& turned) const {
    return "turned more than " + degrees_text(turned.angle);
  }
  std::string operator()(const belief::Touched& touched) const { return "touched " + touched.other; }
  std::string operator()(const belief::StillMoving&) const { return "moving"; }
  std::string operator()(const belief::JointWithin& within) const {
    const auto end = [&](double value) {
      return within.type == belief::JointType::kHinge ? degrees_text(value) : core::rounded_text(value) + " m";
    };
    std::string text = "with " + within.joint;
    if (std::isfinite(within.low)) text += " at least at " + end(within.low);
    if (std::isfinite(within.high))
      text += (std::isfinite(within.low) ? " and" : "") + (" at most at " + end(within.high));
    return text;
  }
};

/// Whether whenever `a` holds at a moment, `b` does not.
struct Excludes {
  bool operator()(const belief::InsideVolume& a, const belief::InsideVolume& b) const {
    // A plane through one box's face that leaves all of the other beyond it.
    const auto apart = [](const belief::InsideVolume& one, const belief::InsideVolume& other) {
      const belief::Pose X = one.X_WV.inverse() * other.X_WV;
      const geometry::Matrix3d reach = X.rotation.toRotationMatrix().cwiseAbs();
      const Vector3d half = reach * (0.5 * other.size);
      return ((X.translation.cwiseAbs() - half - 0.5 * one.size).array() > 0.0).any();
    };
    return apart(a, b) || apart(b, a);
  }
  bool operator()(const belief::FaceUp& a, const belief::FaceUp& b) const { return a.axis_O.dot(b.axis_O) < 0.5; }
  bool operator()(const belief::UprightWithin& a, const belief::UprightWithin& b) const {
    const double between = std::acos(std::clamp(a.axis_O.normalized().dot(b.axis_O.normalized()), -1.0, 1.0));
    return a.max_angle + b.max_angle < between;
  }
  bool operator()(const belief::JointWithin& a, const belief::JointWithin& b) const {
    return a.joint == b.joint && (a.high < b.low || b.high < a.low);
  }
  bool operator()(const belief::RestingOn&, const belief::StillMoving&) const { return true; }
  bool operator()(const belief::StillMoving&, const belief::RestingOn&) const { return true; }
  bool operator()(const belief::BelowHeight& a, const belief::InsideVolume& b) const { return beyond(a, b); }
  bool operator()(const belief::InsideVolume& a, const belief::BelowHeight& b) const { return beyond(b, a); }
  template <class A, class B>
  bool operator()(const A&, const B&) const {
    return false;
  }
  static bool beyond(const belief::BelowHeight& below, const belief::InsideVolume& inside) {
    const Vector3d half = inside.X_WV.rotation.toRotationMatrix().cwiseAbs() * (0.5 * inside.size);
    return inside.X_WV.translation.z() - half.z() >= below.height;
  }
};

/// Whether whenever `a` holds at a moment, `b` does.
struct Implies {
  bool operator()(const belief::BelowHeight& a, const belief::BelowHeight& b) const { return a.height <= b.height; }
  bool operator()(const belief::MovedMoreThan& a, const belief::MovedMoreThan& b) const {
    return a.distance >= b.distance;
  }
  bool operator()(const belief::TurnedMoreThan& a, const belief::TurnedMoreThan& b) const { return a.angle >= b.angle; }
  bool operator()(const belief::UprightWithin& a, const belief::UprightWithin& b) const {
    return a.axis_O == b.axis_O && a.max_angle <= b.max_angle;
  }
  bool operator()(const belief::JointWithin& a, const belief::JointWithin& b) const {
    return a.joint == b.joint && b.low <= a.low && a.high <= b.high;
  }
  bool operator()(const belief::RestingOn& a, const belief::Touched& b) const { return a.support == b.other; }
  template <class A, class B>
  bool operator()(const A& a, const B& b) const {
    if constexpr (std::is_same_v<A, B>) return a == b;
    return false;
  }
};

/// Whether there is a moment, the same for both, at which both have to hold: the end, or any as one holds always.
bool share_a_moment(When a, When b) {
  return (a == When::kAtEnd && b == When::kAtEnd) || a == When::kAlways || b == When::kAlways;
}

std::vector<std::string> all_names(const belief::Scene& scene) {
  std::vector<std::string> names;
  for (const belief::Outcome& outcome : scene.outcomes) names.push_back(outcome.name);
  for (const belief::ExclusiveOutcomes& group : scene.exclusive_outcomes)
    for (const belief::Outcome& outcome : group.outcomes) names.push_back(outcome.name);
  return names;
}

core::Status check_possible(const WantedOutcome& wanted) {
  const std::vector<Condition>& conditions = wanted.outcome.all_of;
  for (std::size_t i = 0; i < conditions.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (const auto reason = contradiction(conditions[j], conditions[i]))
        return core::invalid_input("outcome '" + wanted.name + "' contradicts itself: " + *reason +
                                   ": take one of them out");
  return {};
}

}  // namespace

std::string condition_text(const Condition& condition) {
  const std::string when =
      condition.when == When::kAtEnd || std::holds_alternative<belief::Touched>(condition.predicate)
          ? ""
          : (condition.when == When::kEver ? "ever " : "always ");
  return (condition.negated ? "not " : "") + when + std::visit(PredicateText{}, condition.predicate);
}

std::optional<std::string> contradiction(const Condition& a, const Condition& b) {
  const std::string both = "'" + condition_text(a) + "' and '" + condition_text(b) + "' never hold together";
  if (!a.negated && !b.negated) {
    if (share_a_moment(a.when, b.when) && std::visit(Excludes{}, a.predicate, b.predicate)) return both;
    return std::nullopt;
  }
  if (a.negated && b.negated) return std::nullopt;
  const Condition& is = a.negated ? b : a;
  const Condition& is_not = a.negated ? a : b;
  // What holds at the end or always holds at the end; what holds at all is what is never to.
  const bool same_end = is.when != When::kEver && is_not.when == When::kAtEnd;
  const bool never = is_not.when == When::kEver;
  const bool always = is.when == When::kAlways;
  if ((same_end || never || always) && std::visit(Implies{}, is.predicate, is_not.predicate)) return both;
  return std::nullopt;
}

bool WantedOutcome::holds(const belief::Scene& scene, const belief::Trajectory& run) const {
  return group ? belief::classify(scene, run, *group) == class_index : belief::holds(scene, run, outcome);
}

std::string WantedOutcome::instead(const belief::Scene& scene, const belief::Trajectory& run) const {
  if (group) {
    const auto found = static_cast<std::size_t>(belief::classify(scene, run, *group));
    return found < group->outcomes.size() ? group->outcomes[found].name : "other";
  }
  for (const Condition& condition : outcome.all_of) {
    if (belief::holds(scene, run, {outcome.name, outcome.object, {condition}})) continue;
    Condition opposite = condition;
    opposite.negated = !condition.negated;
    return condition_text(opposite);
  }
  std::string none;
  for (const Condition& condition : outcome.any_of)
    none += (none.empty() ? "none of '" : "', '") + condition_text(condition);
  return none.empty() ? "" : none + "'";
}

core::Result<WantedOutcome> find_wanted(const belief::Scene& scene, const belief::AchieveQuery& query,
                                        const std::vector<std::string>& left_out) {
  WantedOutcome wanted;
  if (query.wanted) {
    wanted.outcome = *query.wanted;
    wanted.name = query.wanted->name;
    PRESCENE_RETURN_IF_ERROR(belief::complete_outcome(scene, wanted.outcome));
    PRESCENE_RETURN_IF_ERROR(belief::validate(scene, wanted.outcome));
    PRESCENE_RETURN_IF_ERROR(check_possible(wanted));
    return wanted;
  }
  std::vector<WantedOutcome> found;
  for (const belief::Outcome& outcome : scene.outcomes)
    if (outcome.name == query.outcome) found.push_back({outcome.name, outcome, std::nullopt, 0});
  for (const belief::ExclusiveOutcomes& group : scene.exclusive_outcomes) {
    for (std::size_t i = 0; i <= group.outcomes.size(); ++i) {
      const bool other = i == group.outcomes.size();
      const std::string name = other ? "other" : group.outcomes[i].name;
      if (query.outcome != name && query.outcome != group.name + "." + name) continue;
      belief::Outcome outcome = other ? belief::Outcome{name, group.outcomes.front().object, {}} : group.outcomes[i];
      found.push_back({group.name + "." + name, std::move(outcome), group, static_cast<int>(i)});
    }
  }
  if (found.size() > 1) {
    std::string names;
    for (const WantedOutcome& one : found) names += (names.empty() ? "" : ", ") + one.name;
    return core::invalid_input("several outcomes are called '" + query.outcome + "': name one of " + names);
  }
  if (found.empty()) {
    if (std::find(left_out.begin(), left_out.end(), query.outcome) != left_out.end())
      return core::not_found("outcome '" + query.outcome +
                             "' cannot be judged now, as an object that it names is lost or was not found");
    const std::vector<std::string> known = all_names(scene);
    const std::string near = core::did_you_mean(query.outcome, known);
    return core::not_found("the scene has no outcome '" + query.outcome + "': " +
                           (!near.empty() ? near
                            : known.empty()
                                ? "it has none; add one to the scene file (outcomes), or give it in the question"
                                : "its outcomes are " + core::comma_list(known)));
  }
  PRESCENE_RETURN_IF_ERROR(check_possible(found.front()));
  return std::move(found.front());
}

std::optional<std::string> named_absent(const WantedOutcome& wanted, const std::vector<std::string>& absent) {
  const auto speaks_of = [&](const belief::Outcome& outcome) -> std::optional<std::string> {
    for (const Condition& condition : belief::all_conditions(outcome)) {
      const auto* resting = std::get_if<belief::RestingOn>(&condition.predicate);
      const auto* touched = std::get_if<belief::Touched>(&condition.predicate);
      const std::string name = resting ? resting->support : touched ? touched->other : "";
      if (std::find(absent.begin(), absent.end(), name) != absent.end()) return name;
    }
    return std::nullopt;
  };
  if (!wanted.group) return speaks_of(wanted.outcome);
  for (const belief::Outcome& outcome : wanted.group->outcomes)
    if (auto name = speaks_of(outcome)) return name;
  return std::nullopt;
}

}  // namespace prescene::queries
