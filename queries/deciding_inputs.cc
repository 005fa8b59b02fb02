// SPDX-License-Identifier: Apache-2.0
// Which uncertain input decides.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "deciding_inputs.h"
#include "prescene/simulation/outcomes/first_order.h"
#include "prescene/simulation/outcomes/repeated_instances.h"
#include "prescene/simulation/rules/action_draws.h"

namespace prescene::queries {
namespace {

using belief::Vector3d;

constexpr std::size_t kFewestInstances = 128;
constexpr std::size_t kMostRolloutsLookedAt = 65536;  // shares of a prefix of the net are those of the whole
constexpr std::size_t kFewestForRest = 512;           // below, first_order_effect() cuts inputs into 4 intervals only
constexpr double kLargestTurn = 2.0;  // rad: beyond it a rotation is no longer described by a turn from its mean
const char* const kAxes[] = {"x", "y", "z"};

bool varies(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return *high - *low > 1e-9 * (1.0 + std::abs(*low));
}

/// The turn about W's z axis of a rotation that is a tilt first and then that turn, in (-pi, pi]. 0 where it is upside
/// down, which leaves it open.
double heading_of(const geometry::Quaterniond& rotation) {
  const double angle = 2.0 * std::atan2(rotation.z(), rotation.w());
  return std::remainder(angle, 2.0 * std::numbers::pi);
}

/// Columns of values, one instance after the other.
class Columns {
 public:
  explicit Columns(std::size_t instances) : instances_(instances) {}

  template <class Value>
  void add(const std::string& name, const Value& value) {
    UncertainInput input{name, std::vector<double>(instances_)};
    for (std::size_t i = 0; i < instances_; ++i) input.values[i] = value(i);
    if (varies(input.values)) inputs_.push_back(std::move(input));
  }
  template <class Value>
  void add_vector(const std::string& name, const Value& value) {
    for (int axis = 0; axis < 3; ++axis)
      add(name + " " + kAxes[axis], [&](std::size_t i) { return Vector3d(value(i))[axis]; });
  }
  /// A rotation: turns from its mean about W's axes, or, when it may be any, how far each axis of the body points up,
  /// and its heading.
  template <class Rotation>
  void add_rotation(const std::string& name, const geometry::Quaterniond& mean, const Rotation& rotation) {
    double largest = 0.0;
    for (std::size_t i = 0; i < instances_; ++i)
      largest = std::max(largest, geometry::angle_between(rotation(i), mean));
    if (largest <= kLargestTurn) {
      for (int axis = 0; axis < 3; ++axis)
        add(name + "turn about " + kAxes[axis],
            [&](std::size_t i) { return geometry::log_rotation(rotation(i) * mean.conjugate())[axis]; });
      return;
    }
    for (int axis = 0; axis < 3; ++axis)
      add(name + kAxes[axis] + " axis upwards",
          [&](std::size_t i) { return Vector3d(rotation(i).conjugate() * Vector3d::UnitZ())[axis]; });
    add(name + "heading", [&](std::size_t i) { return heading_of(rotation(i) * mean.conjugate()); });
  }
  std::vector<UncertainInput> result() && { return std::move(inputs_); }

 private:
  std::size_t instances_;
  std::vector<UncertainInput> inputs_;
};

void add_object(const std::string& name, std::size_t object, const belief::ObjectState& likeliest,
                const std::vector<belief::WorldState>& starts, Columns& columns) {
  const auto at = [&](std::size_t i) -> const belief::ObjectState& { return starts[i].objects[object]; };
  columns.add_vector(name + ": position", [&](std::size_t i) { return at(i).X_WO.translation; });
  columns.add_rotation(name + ": ", likeliest.X_WO.rotation, [&](std::size_t i) { return at(i).X_WO.rotation; });
  columns.add_vector(name + ": velocity", [&](std::size_t i) { return at(i).V_WO.linear; });
  columns.add_vector(name + ": spin", [&](std::size_t i) { return at(i).V_WO.angular; });
  columns.add(name + ": friction", [&](std::size_t i) { return at(i).physical.friction; });
  const bool own = std::any_of(starts.begin(), starts.end(), [&](const belief::WorldState& start) {
    return start.objects[object].physical.impact_friction != start.objects[object].physical.friction;
  });
  if (own) columns.add(name + ": impact friction", [&](std::size_t i) { return at(i).physical.impact_friction; });
  columns.add(name + ": restitution", [&](std::size_t i) { return at(i).physical.restitution; });
  columns.add(name + ": mass", [&](std::size_t i) { return at(i).physical.mass; });
  columns.add_vector(name + ": centre of mass", [&](std::size_t i) { return at(i).physical.center_of_mass; });
}

void add_joints(const belief::Scene& scene, const std::vector<belief::WorldState>& starts, Columns& columns) {
  std::vector<std::vector<belief::JointParameters>> drawn;
  for (const belief::WorldState& start : starts) {
    drawn.emplace_back();
    for (std::size_t j = 0; j < scene.joints.size(); ++j)
      drawn.back().push_back(belief::parameters_of(scene, start, static_cast<int>(j)));
  }
  for (std::size_t j = 0; j < scene.joints.size(); ++j) {
    columns.add(scene.joints[j].name + ": friction", [&](std::size_t i) { return drawn[i][j].friction; });
    columns.add(scene.joints[j].name + ": damping", [&](std::size_t i) { return drawn[i][j].damping; });
  }
}

void add_actions(const Foresight& foresight, const Prior& prior, Columns& columns) {
  const std::vector<belief::Action>& actions = foresight.request.actions;
  if (actions.empty()) return;
  std::vector<std::vector<simulation::DrawnAction>> drawn;
  for (std::size_t i = 0; i < std::min(kMostRolloutsLookedAt, foresight.estimate.instances.size()); ++i)
    drawn.push_back(simulation::draw_actions(actions, prior.stream.at(0, static_cast<std::uint32_t>(i))));
  for (std::size_t a = 0; a < actions.size(); ++a) {
    const auto of = [&](std::size_t i) -> const simulation::DrawnAction& { return drawn[i][a]; };
    if (const auto* release = std::get_if<belief::Release>(&actions[a].what)) {
      columns.add_vector("release of " + release->object + ": velocity",
                         [&](std::size_t i) { return of(i).disturbance.linear; });
      columns.add_vector("release of " + release->object + ": spin",
                         [&](std::size_t i) { return of(i).disturbance.angular; });
    }
    const auto add_goal = [&](const std::string& name, const belief::PoseDistribution& goal) {
      columns.add_vector(name + ": position", [&](std::size_t i) { return of(i).goal.translation; });
      columns.add_rotation(name + ": ", belief::mean(goal).rotation,
                           [&](std::size_t i) { return of(i).goal.rotation; });
    };
    if (const auto* place = std::get_if<belief::Place>(&actions[a].what))
      add_goal("place of " + place->object, place->X_WO);
    if (const auto* transport = std::get_if<belief::Transport>(&actions[a].what))
      add_goal("transport of " + transport->object, transport->X_WO);
    if (std::holds_alternative<belief::Push>(actions[a].what))
      columns.add("push: sideways", [&](std::size_t i) { return of(i).sideways; });
    if (const auto* bump = std::get_if<belief::Bump>(&actions[a].what))
      columns.add_vector("bump of " + bump->object + ": impulse", [&](std::size_t i) { return of(i).impulse; });
    if (const auto* grasp = std::get_if<belief::Grasp>(&actions[a].what); grasp != nullptr && grasp->grip) {
      columns.add("grasp of " + grasp->object + ": grip force", [&](std::size_t i) { return of(i).force; });
      if (grasp->grip->friction)
        columns.add("grasp of " + grasp->object + ": finger friction", [&](std::size_t i) { return *of(i).friction; });
    }
    const auto add_force = [&](const std::string& name) {
      columns.add(name + ": force", [&](std::size_t i) { return of(i).force; });
    };
    if (const auto* pull = std::get_if<belief::Pull>(&actions[a].what)) add_force("pull of " + pull->object);
    if (const auto* move = std::get_if<belief::MoveJoint>(&actions[a].what)) add_force("move of " + move->joint);
    if (const auto* insert = std::get_if<belief::Insert>(&actions[a].what)) {
      add_force("insert of " + insert->object);
      columns.add("insert of " + insert->object + ": torque", [&](std::size_t i) { return of(i).torque; });
    }
  }
}

}  // namespace

std::vector<UncertainInput> uncertain_inputs(const Foresight& foresight, const Prior& prior,
                                             const QueryContext& context) {
  const std::size_t count = std::min(kMostRolloutsLookedAt, foresight.estimate.instances.size());
  const std::vector<belief::WorldState> starts =
      simulation::starts_of(prior.starts, foresight.estimate, count, prior.stream, *context.pool);
  Columns columns(count);
  const belief::Scene& scene = *foresight.scene;
  for (std::size_t o = 0; o < scene.objects.size(); ++o)
    add_object(scene.objects[o].name, o, prior.likeliest.objects[o], starts, columns);
  add_joints(scene, starts, columns);
  add_actions(foresight, prior, columns);
  return std::move(columns).result();
}

std::vector<belief::DecidingInputs> deciding_inputs(const Foresight& foresight, const Prior& prior,
                                                    const QueryContext& context) {
  const std::span instances = std::span(foresight.estimate.instances)
                                  .first(std::min(kMostRolloutsLookedAt, foresight.estimate.instances.size()));
  const auto stopped = [&] { return context.abandoned && context.abandoned->requested(); };
  std::vector<belief::DecidingInputs> all;
  if (instances.size() < kFewestInstances) return all;
  const std::vector<UncertainInput> inputs = uncertain_inputs(foresight, prior, context);
  std::vector<double> weights;
  for (const simulation::InstanceRecord& record : instances) weights.push_back(record.weight);
  for (std::size_t v = 0; v < foresight.variables.size(); ++v) {
    const simulation::Variable& variable = foresight.variables[v];
    std::vector<int> classes;
    for (const simulation::InstanceRecord& record : instances) classes.push_back(record.classes[v]);
    if (std::all_of(classes.begin(), classes.end(), [&](int c) { return c == classes.front(); })) continue;
    belief::DecidingInputs& found = all.emplace_back();
    found.about = name_of(variable);
    found.inputs.resize(inputs.size());
    context.pool->for_each_index(inputs.size(), [&](std::size_t i) {
      if (stopped()) return;
      const simulation::InputEffect effect =
          simulation::first_order_effect(inputs[i].values, classes, static_cast<int>(variable.classes.size()), weights);
      belief::InputShare& input = found.inputs[i];
      input.input = inputs[i].name;
      input.share = effect.share;
      input.standard_error = effect.standard_error;
      for (std::size_t c = 0; c < reported_classes(variable); ++c) {
        if (foresight.estimate.variables[v].classes[c].probability > 0.0)
          input.effects.push_back({variable.classes[c], effect.low_fifth[c], effect.high_fifth[c]});
      }
    });
    if (stopped()) {
      all.pop_back();
      return all;
    }
    if (found.inputs.size() == 1) {
      // Nothing else could: what its values, cut into intervals, do not show is finer than these.
      found.inputs[0].share = 1.0;
      found.inputs[0].standard_error = 0.0;
    }
    double sum = 0.0;
    for (const belief::InputShare& input : found.inputs) sum += input.share;
    found.explained_by_single = std::min(1.0, sum);
    if (instances.size() >= kFewestForRest) found.by_several = 1.0 - found.explained_by_single;
    std::stable_sort(found.inputs.begin(), found.inputs.end(),
                     [](const belief::InputShare& a, const belief::InputShare& b) { return a.share > b.share; });
  }
  return all;
}

}  // namespace prescene::queries
