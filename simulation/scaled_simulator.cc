// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "prescene/simulation/own_actions.h"
#include "prescene/simulation/similarity.h"

namespace prescene::simulation {
namespace {

/// Physical parameters do not change while a world is simulated: they come back without rounding.
void take_parameters(const belief::WorldState& from, belief::WorldState& to) {
  for (std::size_t i = 0; i < std::min(from.objects.size(), to.objects.size()); ++i)
    to.objects[i].physical = from.objects[i].physical;
  if (from.joints.size() == to.joints.size()) to.joints = from.joints;
}

class ScaledEndRule : public EndRule {
 public:
  ScaledEndRule(const EndRule& rule, const Similarity& to_true) : rule_(rule), to_true_(to_true) {}
  bool ends(const belief::WorldState& state, double seconds_left) const override {
    return rule_.ends(scaled(state, to_true_), seconds_left * to_true_.time());
  }

 private:
  const EndRule& rule_;
  Similarity to_true_;
};

class ScaledInstance : public Instance {
 public:
  ScaledInstance(std::unique_ptr<Instance> instance, const Similarity& to_true)
      : instance_(std::move(instance)), to_true_(to_true) {}

  void set_state(const belief::WorldState& state) override { instance_->set_state(scaled(state, to_true_.inverse())); }
  belief::WorldState state() const override { return scaled(instance_->state(), to_true_); }
  void step() override { instance_->step(); }
  double step_size() const override { return instance_->step_size() * to_true_.time(); }
  bool at_rest() const override { return instance_->at_rest(); }
  Snapshot save() const override { return instance_->save(); }
  core::Status restore(const Snapshot& snapshot) override { return instance_->restore(snapshot); }

 private:
  std::unique_ptr<Instance> instance_;
  Similarity to_true_;
};

class ScaledSimulator : public Simulator, public OwnActionsRunner {
 public:
  ScaledSimulator(std::unique_ptr<Simulator> simulator, const Similarity& to_true)
      : simulator_(std::move(simulator)), to_true_(to_true) {}

  core::Status supports(const RunRequest& request) const override { return simulator_->supports(inside(request)); }
  StepperUse stepper() const override {
    StepperUse use = simulator_->stepper();
    use.hull_error *= to_true_.length;
    return use;
  }
  double step_size() const override { return simulator_->step_size() * to_true_.time(); }
  double length_scale() const override { return simulator_->length_scale() * to_true_.length; }

  void run(std::span<const belief::WorldState> starts, const RunRequest& request, const core::RandomStream& stream,
           InstanceNumbers numbers, core::ThreadPool& pool, std::span<belief::Trajectory> trajectories,
           const core::Cancellation* cancellation) const override {
    run_inside(starts, request, trajectories, [&](std::span<const belief::WorldState> inner, const RunRequest& mine) {
      simulator_->run(inner, mine, stream, numbers, pool, trajectories, cancellation);
    });
  }

  void run_own(std::span<const belief::WorldState> starts, std::span<const std::vector<belief::Action>> actions,
               const RunRequest& request, const core::RandomStream& stream, InstanceNumbers numbers,
               core::ThreadPool& pool, std::span<belief::Trajectory> trajectories,
               const core::Cancellation* cancellation) const override {
    std::vector<std::vector<belief::Action>> own;
    own.reserve(actions.size());
    for (const std::vector<belief::Action>& each : actions) own.push_back(inside(each));
    run_inside(starts, request, trajectories, [&](std::span<const belief::WorldState> inner, const RunRequest& mine) {
      run_own_actions(*simulator_, inner, own, mine, stream, numbers, pool, trajectories, cancellation);
    });
  }

  std::unique_ptr<Instance> make_instance(const std::vector<belief::Action>& actions,
                                          const core::RandomStream& stream) const override {
    return std::make_unique<ScaledInstance>(simulator_->make_instance(inside(actions), stream), to_true_);
  }

 private:
  template <typename Run>
  void run_inside(std::span<const belief::WorldState> starts, const RunRequest& request,
                  std::span<belief::Trajectory> trajectories, const Run& run) const {
    std::vector<belief::WorldState> inner;
    inner.reserve(starts.size());
    for (const belief::WorldState& start : starts) inner.push_back(scaled(start, to_true_.inverse()));
    RunRequest inner_request = inside(request);
    std::optional<ScaledEndRule> rule;
    if (request.end_rule != nullptr) inner_request.end_rule = &rule.emplace(*request.end_rule, to_true_);
    run(inner, inner_request);
    for (std::size_t i = 0; i < trajectories.size(); ++i) {
      scale(to_true_, trajectories[i]);
      for (belief::WorldState& state : trajectories[i].states) take_parameters(starts[i], state);
      if (!trajectories[i].states.empty()) trajectories[i].states.front() = first_of(trajectories[i], starts[i]);
    }
  }
  /// The start without rounding, but with what the simulator set of it.
  static belief::WorldState first_of(const belief::Trajectory& trajectory, const belief::WorldState& start) {
    belief::WorldState first = start;
    for (std::size_t i = 0; i < first.objects.size(); ++i) first.objects[i].mode = trajectory.start().objects[i].mode;
    return first;
  }
  std::vector<belief::Action> inside(const std::vector<belief::Action>& actions) const {
    std::vector<belief::Action> result;
    result.reserve(actions.size());
    for (const belief::Action& action : actions) result.push_back(scaled(action, to_true_.inverse()));
    return result;
  }
  RunRequest inside(const RunRequest& request) const {
    RunRequest result = request;
    result.actions = inside(request.actions);
    result.stop.duration /= to_true_.time();
    result.stop.world_radius /= to_true_.length;
    result.sample_interval /= to_true_.time();
    return result;
  }

  std::unique_ptr<Simulator> simulator_;
  Similarity to_true_;
};

}  // namespace

std::unique_ptr<Simulator> make_scaled_simulator(std::unique_ptr<Simulator> simulator, const Similarity& similarity) {
  return std::make_unique<ScaledSimulator>(std::move(simulator), similarity);
}

}  // namespace prescene::simulation
