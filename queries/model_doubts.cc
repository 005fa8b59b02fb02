// SPDX-License-Identifier: Apache-2.0
// What else could have come out: from starts near by, with other steps, with other parameters; and the ways there.
#include <algorithm>
#include <cmath>
#include <functional>

#include "model_doubts.h"
#include "prescene/core/text.h"
#include "prescene/simulation/outcomes/repeated_instances.h"

namespace prescene::queries {
namespace {

using Kind = belief::ModelError::Kind;
using Classes = std::vector<std::vector<int>>;

constexpr double kDisplacement = 0.1;  // standard deviations
constexpr double kChaotic = 0.1;       // share of pairs that end otherwise
constexpr std::size_t kFewestComparedPairs = 32, kMostComparedPairs = 128;
// Pairs with which the model's error begins, the most of a variant, and of all of them.
constexpr std::size_t kFirstRepeated = 256, kMostRepeated = 12'288, kMostRuns = 131'072;
constexpr int kMoreRounds = 3;                     // of more pairs, each as many as the one before shows are needed
constexpr double kWantedShift = 0.03;              // that is to be found in nine cases of ten
constexpr double kClear = 3.0;                     // times beyond what chance explains: need not be known better
constexpr double kLowEnd = 0.05, kHighEnd = 0.95;  // of priors
constexpr double kPathInterval = 1.0 / 30.0;
constexpr std::size_t kPathsAtOnce = 48;          // bounds the memory; does not change results
constexpr std::size_t kMostPathPoints = 300'000;  // of all paths: 20 MB of JSON

void report_progress(const QueryContext& context, double fraction, const std::string& text) {
  if (context.progress) context.progress({fraction, std::nullopt, text});
}

Classes classes_so_far(const Foresight& foresight, std::size_t count) {
  Classes classes;
  for (std::size_t i = 0; i < count; ++i) classes.push_back(foresight.estimate.instances[i].classes);
  return classes;
}

/// A parameter and how a state's is set.
struct Parameter {
  const char* name;
  double (*get)(const belief::PhysicalParameters&);
  void (*set)(belief::PhysicalParameters&, double);
};
const Parameter kParameters[] = {
    {"friction", [](const belief::PhysicalParameters& p) { return p.friction; },
     [](belief::PhysicalParameters& p, double value) {
       if (p.impact_friction == p.friction) p.impact_friction = value;  // one number, unless given apart
       p.friction = value;
     }},
    {"restitution", [](const belief::PhysicalParameters& p) { return p.restitution; },
     [](belief::PhysicalParameters& p, double value) { p.restitution = value; }},
    {"mass", [](const belief::PhysicalParameters& p) { return p.mass; },
     [](belief::PhysicalParameters& p, double value) { p.mass = value; }},
    {"centre of mass x", [](const belief::PhysicalParameters& p) { return p.center_of_mass.x(); },
     [](belief::PhysicalParameters& p, double value) { p.center_of_mass.x() = value; }},
    {"centre of mass y", [](const belief::PhysicalParameters& p) { return p.center_of_mass.y(); },
     [](belief::PhysicalParameters& p, double value) { p.center_of_mass.y() = value; }},
    {"centre of mass z", [](const belief::PhysicalParameters& p) { return p.center_of_mass.z(); },
     [](belief::PhysicalParameters& p, double value) { p.center_of_mass.z() = value; }},
};

/// A way in which the model could be otherwise.
struct Variant {
  Kind kind = Kind::kPrior;
  std::string what;
  double step_factor = 1.0;
  std::shared_ptr<const belief::Scene> scene;
  std::function<void(belief::WorldState&)> change;  // of a start; may be empty
};

void add_object_ends(const std::shared_ptr<const belief::Scene>& scene, const std::vector<belief::WorldState>& starts,
                     std::vector<Variant>& variants) {
  for (std::size_t o = 0; o < scene->objects.size(); ++o) {
    for (const Parameter& parameter : kParameters) {
      std::vector<double> values;
      for (const belief::WorldState& start : starts) values.push_back(parameter.get(start.objects[o].physical));
      std::sort(values.begin(), values.end());
      if (values.back() - values.front() <= 1e-9 * (1.0 + std::abs(values.front()))) continue;
      for (const double end : {kLowEnd, kHighEnd}) {
        const double value =
            values[static_cast<std::size_t>(std::lround(end * static_cast<double>(values.size() - 1)))];
        variants.push_back(
            {Kind::kPrior, scene->objects[o].name + ": " + parameter.name + " at " + core::rounded_text(value), 1.0,
             scene,
             [o, set = parameter.set, value](belief::WorldState& start) { set(start.objects[o].physical, value); }});
      }
    }
  }
}

void add_joint_ends(const std::shared_ptr<const belief::Scene>& scene, const std::vector<belief::WorldState>& starts,
                    std::vector<Variant>& variants) {
  using Member = double belief::JointParameters::*;
  const std::pair<const char*, Member> members[] = {{"friction", &belief::JointParameters::friction},
                                                    {"damping", &belief::JointParameters::damping}};
  for (std::size_t j = 0; j < scene->joints.size(); ++j) {
    for (const auto& [name, member] : members) {
      std::vector<double> values;
      for (const belief::WorldState& start : starts)
        if (j < start.joints.size()) values.push_back(start.joints[j].*member);
      std::sort(values.begin(), values.end());
      if (values.empty() || values.back() - values.front() <= 1e-9 * (1.0 + std::abs(values.front()))) continue;
      for (const double end : {kLowEnd, kHighEnd}) {
        const double value =
            values[static_cast<std::size_t>(std::lround(end * static_cast<double>(values.size() - 1)))];
        variants.push_back({Kind::kPrior, scene->joints[j].name + ": " + name + " at " + core::rounded_text(value), 1.0,
                            scene, [j, member = member, value](belief::WorldState& start) {
                              if (j < start.joints.size()) start.joints[j].*member = value;
                            }});
      }
    }
  }
}

void add_support_ends(const std::shared_ptr<const belief::Scene>& scene, std::vector<Variant>& variants) {
  using Member = belief::ScalarDistribution belief::ContactProperties::*;
  const std::pair<const char*, Member> members[] = {{"friction", &belief::ContactProperties::friction},
                                                    {"restitution", &belief::ContactProperties::restitution}};
  for (std::size_t s = 0; s < scene->supports.size(); ++s) {
    for (const auto& [name, member] : members) {
      const belief::ScalarDistribution& prior = scene->supports[s].contact.*member;
      if (belief::dimensions(prior) != 1) continue;
      for (const double end : {kLowEnd, kHighEnd}) {
        const double value = belief::draw(prior, std::span(&end, 1));
        auto changed = std::make_shared<belief::Scene>(*scene);
        changed->supports[s].contact.*member = belief::FixedScalar{value};
        variants.push_back({Kind::kPrior,
                            scene->supports[s].name + ": " + name + " at " + core::rounded_text(value),
                            1.0,
                            changed,
                            {}});
      }
    }
  }
}

/// Instances and what becomes of them in each variant.
struct Pairs {
  std::vector<double> weights;  // of instances
  Classes before;
  std::vector<Classes> after;  // by variant
};

/// By how much each probability differs, over the instances of which both are known.
std::vector<belief::ModelError::Shift> shifts_of(const Foresight& foresight, std::span<const double> weights,
                                                 const Classes& before, const Classes& after, double confidence) {
  std::vector<belief::ModelError::Shift> shifts;
  const double reach = core::inverse_normal_cdf(0.5 + 0.5 * confidence);
  for (std::size_t v = 0; v < foresight.variables.size(); ++v) {
    const simulation::Variable& variable = foresight.variables[v];
    for (std::size_t c = 0; c < reported_classes(variable); ++c) {
      double weight = 0.0, squares = 0.0, sum = 0.0, sum_squares = 0.0;
      for (std::size_t i = 0; i < before.size(); ++i) {
        if (before[i][v] < 0 || after[i][v] < 0) continue;
        const double w = weights[i];
        const int is = static_cast<int>(c);
        const double change = (after[i][v] == is ? 1.0 : 0.0) - (before[i][v] == is ? 1.0 : 0.0);
        weight += w;
        squares += w * w;
        sum += w * change;
        sum_squares += w * change * change;
      }
      belief::ModelError::Shift& shift = shifts.emplace_back();
      shift.outcome = variable.classes[c];
      shift.group = variable.name;
      shift.low = -1.0;
      shift.high = 1.0;
      if (!(weight > 0.0)) continue;
      shift.shift = sum / weight;
      const double count = weight * weight / squares;
      const double variance = std::max(0.0, sum_squares / weight - shift.shift * shift.shift) / count;
      // The continuity term is what keeps no change at all from being reported as certainly none.
      const double half = reach * std::sqrt(variance + 1.0 / (count * count));
      shift.low = std::max(-1.0, shift.shift - half);
      shift.high = std::min(1.0, shift.shift + half);
    }
  }
  return shifts;
}

belief::ModelError error_of(const Foresight& foresight, const std::vector<Variant>& variants, const Pairs& pairs,
                            double confidence) {
  belief::ModelError error;
  error.instances = static_cast<int>(pairs.before.size());
  for (std::size_t n = 0; n < variants.size(); ++n)
    error.variants.push_back({variants[n].kind, variants[n].what,
                              shifts_of(foresight, pairs.weights, pairs.before, pairs.after[n], confidence)});
  return error;
}

/// How many pairs it takes until a shift of kWantedShift would be found, or those that there are stand out clearly.
std::size_t pairs_needed(const belief::ModelError& error, double confidence) {
  double more = 1.0;
  for (const belief::ModelError::Variant& variant : error.variants) {
    const double wider = widening(error, variant.kind, confidence);
    for (const belief::ModelError::Shift& shift : variant.shifts) {
      if (std::abs(shift.shift) > kClear * wider * 0.5 * (shift.high - shift.low)) continue;
      more = std::max(more, findable(shift, wider, confidence) / kWantedShift);
    }
  }
  return static_cast<std::size_t>(std::ceil(1.05 * more * more * error.instances));
}

}  // namespace

std::vector<belief::ChaosCheck> check_for_chaos(const Foresight& foresight, const Prior& prior, double confidence,
                                                const QueryContext& context) {
  const std::size_t instances = foresight.estimate.instances.size();
  if (instances < kFewestComparedPairs || foresight.variables.empty()) return {};
  const std::size_t pairs = std::clamp(instances / 8, kFewestComparedPairs, kMostComparedPairs);
  report_progress(context, 0.0, "looking whether small differences decide");
  const std::vector<belief::WorldState> starts =
      simulation::starts_nearby(prior.starts, foresight.estimate, pairs, kDisplacement, prior.stream, *context.pool);
  const auto after =
      simulation::classes_from(*foresight.simulator, starts, foresight.variables, foresight.request, prior.stream,
                               foresight.certifier.get(), *context.pool, context.cancellation);
  if (!after) return {};
  std::vector<belief::ChaosCheck> checks;
  for (std::size_t v = 0; v < foresight.variables.size(); ++v) {
    std::vector<simulation::ComponentClasses> both(1);
    for (std::size_t i = 0; i < pairs; ++i) {
      const int before = foresight.estimate.instances[i].classes[v];
      if (before >= 0 && (*after)[i][v] >= 0) both[0].classes.push_back((*after)[i][v] == before ? 1 : 0);
    }
    if (both[0].classes.empty()) continue;
    const simulation::ClassEstimate changed = simulation::class_estimate(both, 0, confidence);
    belief::ChaosCheck& check = checks.emplace_back();
    check.about = name_of(foresight.variables[v]);
    check.pairs = static_cast<int>(both[0].classes.size());
    check.displacement = kDisplacement;
    check.changed = changed.probability;
    check.low = changed.low;
    check.high = changed.high;
    check.chaotic = changed.low > kChaotic;
  }
  return checks;
}

double widening(const belief::ModelError& error, belief::ModelError::Kind kind, double confidence) {
  std::size_t comparisons = 0;
  for (const belief::ModelError::Variant& variant : error.variants)
    if (variant.kind == kind) comparisons += variant.shifts.size();
  return core::inverse_normal_cdf(1.0 - 0.5 * (1.0 - confidence) /
                                            static_cast<double>(std::max<std::size_t>(1, comparisons))) /
         core::inverse_normal_cdf(0.5 + 0.5 * confidence);
}

double findable(const belief::ModelError::Shift& shift, double wider, double confidence) {
  constexpr double kPower = 0.9;
  const double half = 0.5 * (shift.high - shift.low);
  const double deviation = half / core::inverse_normal_cdf(0.5 + 0.5 * confidence);
  return wider * half + core::inverse_normal_cdf(kPower) * deviation;
}

core::Result<std::optional<belief::ModelError>> model_error(const Foresight& foresight, const Prior& prior,
                                                            double confidence, const QueryContext& context) {
  const std::size_t first = std::min(kFirstRepeated, foresight.estimate.instances.size());
  const std::vector<belief::WorldState> own =
      simulation::starts_of(prior.starts, foresight.estimate, first, prior.stream, *context.pool);
  std::vector<Variant> variants = {{Kind::kStep, "half the step", 0.5, foresight.scene, {}},
                                   {Kind::kStep, "twice the step", 2.0, foresight.scene, {}}};
  add_object_ends(foresight.scene, own, variants);
  add_support_ends(foresight.scene, variants);
  add_joint_ends(foresight.scene, own, variants);
  std::vector<std::unique_ptr<simulation::Simulator>> simulators;
  for (const Variant& variant : variants) {
    PRESCENE_TRY(auto simulator, context.make_simulator(*variant.scene, variant.step_factor));
    simulators.push_back(std::move(simulator));
  }
  const core::Cancellation until = end_of_simulating(context);
  const core::Cancellation* cancellation = context.cancellation;
  const auto classes = [&](const simulation::Simulator& simulator, std::span<const belief::WorldState> starts,
                           std::uint32_t number) {
    // No certificates: they know the scene's friction, not a variant's.
    return simulation::classes_from(simulator, starts, foresight.variables, foresight.request, prior.stream, nullptr,
                                    *context.pool, cancellation, number);
  };
  double done = 0.0;
  const auto add_after = [&](const std::vector<belief::WorldState>& starts, std::uint32_t number, double share,
                             Pairs& pairs) {
    pairs.after.resize(variants.size());
    for (std::size_t n = 0; n < variants.size(); ++n) {
      report_progress(context, done, "the model's error: " + variants[n].what);
      std::vector<belief::WorldState> changed = starts;
      if (variants[n].change)
        for (belief::WorldState& start : changed) variants[n].change(start);
      auto after = classes(*simulators[n], changed, number);
      if (!after) return false;
      pairs.after[n].insert(pairs.after[n].end(), after->begin(), after->end());
      done += share / static_cast<double>(variants.size());
    }
    return true;
  };

  // The answer's own instances once more.
  Pairs pairs;
  pairs.before = classes_so_far(foresight, first);
  for (std::size_t i = 0; i < first; ++i) pairs.weights.push_back(foresight.estimate.instances[i].weight);
  if (!add_after(own, 0, 1.0 / (1 + kMoreRounds), pairs)) return std::optional<belief::ModelError>();
  belief::ModelError error = error_of(foresight, variants, pairs, confidence);
  if (foresight.estimate.instances.size() < 2) return std::optional(std::move(error));  // nothing is uncertain

  // Others, until they say enough; when time ends, those that are complete.
  cancellation = &until;
  Pairs fresh;
  const std::size_t most = std::min(kMostRepeated, kMostRuns / variants.size());
  for (int round = 0; round < kMoreRounds; ++round) {
    const std::size_t have = fresh.before.size();
    const std::size_t wanted = std::min(most, pairs_needed(error, confidence));
    if (wanted <= static_cast<std::size_t>(error.instances)) break;
    const auto number = static_cast<std::uint32_t>(have);
    const std::vector<belief::WorldState> starts =
        simulation::fresh_starts(prior.starts, number, wanted - have, prior.stream, *context.pool);
    const auto before = classes(*foresight.simulator, starts, number);
    if (!before || !add_after(starts, number, 1.0 / (1 + kMoreRounds), fresh)) break;
    fresh.before.insert(fresh.before.end(), before->begin(), before->end());
    fresh.weights.assign(wanted, 1.0);
    error = error_of(foresight, variants, fresh, confidence);
  }
  return std::optional(std::move(error));
}

std::vector<belief::ObjectPath> paths_of(const Foresight& foresight, const Prior& prior, int count,
                                         const std::vector<std::size_t>& objects, const QueryContext& context,
                                         bool& complete) {
  const auto runs = std::min(static_cast<std::size_t>(std::max(0, count)), foresight.estimate.instances.size());
  const std::vector<belief::WorldState> starts =
      simulation::starts_of(prior.starts, foresight.estimate, runs, prior.stream, *context.pool);
  simulation::RunRequest request = foresight.request;
  request.sample_interval = interval_told(foresight, kPathInterval);
  std::vector<belief::ObjectPath> paths;
  std::vector<belief::Trajectory> trajectories;
  std::size_t points = 0;
  for (std::size_t begin = 0; begin < runs; begin += trajectories.size()) {
    trajectories.assign(std::min(kPathsAtOnce, runs - begin), {});
    foresight.simulator->run(std::span(starts).subspan(begin, trajectories.size()), request, prior.stream,
                             static_cast<std::uint32_t>(begin), *context.pool, trajectories, context.cancellation);
    for (std::size_t n = 0; n < trajectories.size(); ++n) {
      const std::size_t i = begin + n;
      if (foresight.estimate.instances[i].failed) continue;
      points += trajectories[n].states.size() * objects.size();
      if (trajectories[n].end == belief::TrajectoryEnd::kCancelled || points > kMostPathPoints) {
        complete = false;
        return paths;
      }
      for (const std::size_t object : objects) {
        belief::ObjectPath& path = paths.emplace_back();
        path.object = foresight.scene->objects[object].name;
        if (const auto variable = variable_about(*foresight.scene, path.object)) {
          const int which = foresight.estimate.instances[i].classes[*variable];
          path.outcome = foresight.variables[*variable].classes[static_cast<std::size_t>(which)];
        }
        for (const belief::WorldState& state : trajectories[n].states) {
          if (state.objects[object].mode == belief::MotionMode::kHeld) path.points.clear();  // it begins when let go
          path.points.push_back(state.objects[object].X_WO.translation);
        }
      }
    }
  }
  return paths;
}

}  // namespace prescene::queries
