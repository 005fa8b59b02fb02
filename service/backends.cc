// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/backends.h"

#include <algorithm>
#include <functional>
#include <mutex>
#include <utility>

#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"
#include "prescene/simulation/own_actions.h"
#include "prescene/simulation/similarity.h"

namespace prescene::service {
namespace {

simulation::LockstepOptions lockstep_options(const simulation::BulletOptions& bullet) {
  simulation::LockstepOptions options{bullet};
  options.solver_accuracy = std::max(options.solver_accuracy, bullet.solver_accuracy);
  return options;
}

/// Runs in lockstep what that supports, and by Bullet's stepper what else it is given; single instances, which would
/// leave the lanes empty, too.
class EitherSimulator : public simulation::Simulator, public simulation::OwnActionsRunner {
 public:
  /// `on_bullet` gets the reason, once for each run that Bullet's stepper has to take over.
  EitherSimulator(std::unique_ptr<simulation::Simulator> lockstep, std::unique_ptr<simulation::Simulator> bullet,
                  std::function<void(const std::string&)> on_bullet)
      : lockstep_(std::move(lockstep)), bullet_(std::move(bullet)), on_bullet_(std::move(on_bullet)) {}

  void run(std::span<const belief::WorldState> starts, const simulation::RunRequest& request,
           const core::RandomStream& stream, simulation::InstanceNumbers numbers, core::ThreadPool& pool,
           std::span<belief::Trajectory> trajectories, const core::Cancellation* cancellation) const override {
    const core::Status in_lockstep = lockstep_->supports(request);
    if (!in_lockstep.ok()) on_bullet_(in_lockstep.message());
    const simulation::Simulator& simulator = in_lockstep.ok() ? *lockstep_ : *bullet_;
    simulator.run(starts, request, stream, numbers, pool, trajectories, cancellation);
  }

  void run_own(std::span<const belief::WorldState> starts, std::span<const std::vector<belief::Action>> actions,
               const simulation::RunRequest& request, const core::RandomStream& stream,
               simulation::InstanceNumbers numbers, core::ThreadPool& pool, std::span<belief::Trajectory> trajectories,
               const core::Cancellation* cancellation) const override {
    core::Status in_lockstep = core::ok_status();
    simulation::RunRequest asked = request;
    for (const std::vector<belief::Action>& own : actions) {
      asked.actions = own;
      in_lockstep = lockstep_->supports(asked);
      if (!in_lockstep.ok()) break;
    }
    if (!in_lockstep.ok()) on_bullet_(in_lockstep.message());
    simulation::run_own_actions(in_lockstep.ok() ? *lockstep_ : *bullet_, starts, actions, request, stream, numbers,
                                pool, trajectories, cancellation);
  }

  simulation::StepperUse stepper() const override { return lockstep_->stepper(); }
  double step_size() const override { return bullet_->step_size(); }

  std::unique_ptr<simulation::Instance> make_instance(const std::vector<belief::Action>& actions,
                                                      const core::RandomStream& stream) const override {
    return bullet_->make_instance(actions, stream);
  }

 private:
  std::unique_ptr<simulation::Simulator> lockstep_, bullet_;
  std::function<void(const std::string&)> on_bullet_;
};

/// Bullet's simulator where lockstep was tried first.
class InsteadOfLockstep : public simulation::Simulator {
 public:
  InsteadOfLockstep(std::unique_ptr<simulation::Simulator> bullet, std::string reason)
      : bullet_(std::move(bullet)), reason_(std::move(reason)) {}

  core::Status supports(const simulation::RunRequest& request) const override { return bullet_->supports(request); }
  simulation::StepperUse stepper() const override {
    simulation::StepperUse use = bullet_->stepper();
    use.not_lockstep = reason_;
    return use;
  }
  void run(std::span<const belief::WorldState> starts, const simulation::RunRequest& request,
           const core::RandomStream& stream, simulation::InstanceNumbers numbers, core::ThreadPool& pool,
           std::span<belief::Trajectory> trajectories, const core::Cancellation* cancellation) const override {
    bullet_->run(starts, request, stream, numbers, pool, trajectories, cancellation);
  }
  double step_size() const override { return bullet_->step_size(); }
  std::unique_ptr<simulation::Instance> make_instance(const std::vector<belief::Action>& actions,
                                                      const core::RandomStream& stream) const override {
    return bullet_->make_instance(actions, stream);
  }

 private:
  std::unique_ptr<simulation::Simulator> bullet_;
  std::string reason_;
};

}  // namespace

/// Shared with the simulators, which may outlive the backends.
class Backends::StepperLog {
 public:
  void in_lockstep() {
    const std::lock_guard lock(mutex_);
    ++counts_.lockstep;
  }
  void by_bullet(const std::string& reason) {
    const std::lock_guard lock(mutex_);
    ++counts_.bullet_instead;
    counts_.last_reason = reason;
  }
  StepperCounts counts() const {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

 private:
  mutable std::mutex mutex_;
  StepperCounts counts_;
};

Backends::Backends(core::ThreadPool& pool, const BackendSettings& settings)
    : pool_(pool),
      settings_(settings),
      stepper_log_(std::make_shared<StepperLog>()),
      shapes_(simulation::hacd_decomposer()) {}

StepperCounts Backends::stepper_counts() const { return stepper_log_->counts(); }

core::Result<std::unique_ptr<simulation::Simulator>> Backends::make_simulator(const belief::Scene& scene,
                                                                              double step_factor) {
  const simulation::Similarity similarity = simulation::similarity_of(scene);
  simulation::BulletOptions options = settings_.bullet;
  if (scene.step) options.step = *scene.step / similarity.time();
  options.step *= step_factor;
  if (similarity.length == 1.0) return make_simulator_as_it_is(scene, options);
  PRESCENE_TRY(auto simulator, make_simulator_as_it_is(simulation::scaled(scene, similarity.inverse()), options));
  return simulation::make_scaled_simulator(std::move(simulator), similarity);
}

core::Result<std::unique_ptr<simulation::Simulator>> Backends::make_simulator_as_it_is(
    const belief::Scene& scene, const simulation::BulletOptions& options) {
  if (settings_.stepper == Stepper::kBullet) return simulation::make_bullet_simulator(scene, shapes_, options);
  auto lockstep = simulation::make_lockstep_simulator(scene, shapes_, lockstep_options(options));
  if (settings_.stepper == Stepper::kLockstep) {
    if (!lockstep && lockstep.status().code() == core::StatusCode::kUnsupported)
      return core::unsupported(lockstep.status().message() +
                               ": '--stepper bullet' can simulate it, and '--stepper automatic' chooses by itself");
    if (lockstep) stepper_log_->in_lockstep();
    return lockstep;
  }
  if (!lockstep && lockstep.status().code() != core::StatusCode::kUnsupported) return lockstep.status();
  PRESCENE_TRY(auto bullet, simulation::make_bullet_simulator(scene, shapes_, options));
  if (!lockstep) {
    const std::string reason = lockstep.status().message();
    stepper_log_->by_bullet(reason);
    return std::unique_ptr<simulation::Simulator>(std::make_unique<InsteadOfLockstep>(std::move(bullet), reason));
  }
  stepper_log_->in_lockstep();
  return std::unique_ptr<simulation::Simulator>(
      std::make_unique<EitherSimulator>(*std::move(lockstep), std::move(bullet),
                                        [log = stepper_log_](const std::string& reason) { log->by_bullet(reason); }));
}

simulation::SimulatorFactory Backends::simulator_factory() {
  return [this](const belief::Scene& scene, double step_factor) { return make_simulator(scene, step_factor); };
}

core::Result<std::unique_ptr<rendering::Renderer>> Backends::make_renderer() {
  return rendering::make_reference_renderer();
}

core::Result<std::unique_ptr<rendering::LikelihoodBatch>> Backends::make_likelihood() {
  return rendering::make_likelihood_batch(settings_.likelihood);
}

queries::QueryContext Backends::query_context(core::ThreadPool& pool) {
  queries::QueryContext context;
  context.make_simulator = simulator_factory();
  context.make_renderer = [this] { return make_renderer(); };
  context.edge_rounding = settings_.bullet.edge_rounding;
  context.shapes = &shapes_;
  context.pool = &pool;
  context.meshes = &meshes_;
  return context;
}

}  // namespace prescene::service
