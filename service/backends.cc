// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/backends.h"

#include <algorithm>
#include <utility>

#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/simulation/bullet/convex_decomposition.h"
#include "prescene/simulation/lockstep/lockstep_simulator.h"

namespace prescene::service {
namespace {

simulation::LockstepOptions lockstep_options(const simulation::BulletOptions& bullet) {
  simulation::LockstepOptions options{bullet};
  options.solver_accuracy = std::max(options.solver_accuracy, bullet.solver_accuracy);
  return options;
}

/// Runs in lockstep what that supports; other actions, and single instances, go to Bullet.
class EitherSimulator : public simulation::Simulator {
 public:
  EitherSimulator(std::unique_ptr<simulation::Simulator> lockstep, std::unique_ptr<simulation::Simulator> bullet)
      : lockstep_(std::move(lockstep)), bullet_(std::move(bullet)) {}

  void run(std::span<const belief::WorldState> starts, const simulation::RunRequest& request,
           const core::RandomStream& stream, simulation::InstanceNumbers numbers, core::ThreadPool& pool,
           std::span<belief::Trajectory> trajectories, const core::Cancellation* cancellation) const override {
    const simulation::Simulator& simulator = simulation::lockstep_supports(request).ok() ? *lockstep_ : *bullet_;
    simulator.run(starts, request, stream, numbers, pool, trajectories, cancellation);
  }

  double step_size() const override { return bullet_->step_size(); }

  std::unique_ptr<simulation::Instance> make_instance(const std::vector<belief::Action>& actions,
                                                      const core::RandomStream& stream) const override {
    return bullet_->make_instance(actions, stream);
  }

 private:
  std::unique_ptr<simulation::Simulator> lockstep_, bullet_;
};

}  // namespace

Backends::Backends(core::ThreadPool& pool, const BackendSettings& settings)
    : pool_(pool), settings_(settings), shapes_(simulation::hacd_decomposer()) {}

core::Result<std::unique_ptr<simulation::Simulator>> Backends::make_simulator(const belief::Scene& scene,
                                                                              double step_factor) {
  simulation::BulletOptions options = settings_.bullet;
  options.step *= step_factor;
  if (settings_.stepper == Stepper::kBullet) return simulation::make_bullet_simulator(scene, shapes_, options);
  auto lockstep = simulation::make_lockstep_simulator(scene, shapes_, lockstep_options(options));
  if (!lockstep) {
    const bool other_stepper = settings_.stepper == Stepper::kAutomatic;
    if (lockstep.status().code() != core::StatusCode::kUnsupported) return lockstep.status();
    if (!other_stepper)
      return core::unsupported(lockstep.status().message() +
                               "; '--stepper bullet' can, and 'automatic' chooses by itself");
    return simulation::make_bullet_simulator(scene, shapes_, options);
  }
  PRESCENE_TRY(auto bullet, simulation::make_bullet_simulator(scene, shapes_, options));
  return std::unique_ptr<simulation::Simulator>(
      std::make_unique<EitherSimulator>(*std::move(lockstep), std::move(bullet)));
}

core::Result<std::unique_ptr<rendering::Renderer>> Backends::make_renderer() {
  return rendering::make_reference_renderer();
}

core::Result<std::unique_ptr<rendering::LikelihoodBatch>> Backends::make_likelihood() {
  return rendering::make_likelihood_batch(settings_.likelihood);
}

queries::QueryContext Backends::query_context(core::ThreadPool& pool) {
  queries::QueryContext context;
  context.make_simulator = [this](const std::shared_ptr<const belief::Scene>& scene) { return make_simulator(*scene); };
  context.make_simulator_of_step = [this](const std::shared_ptr<const belief::Scene>& scene, double factor) {
    return make_simulator(*scene, factor);
  };
  context.make_renderer = [this] { return make_renderer(); };
  context.edge_rounding = settings_.bullet.edge_rounding;
  context.shapes = &shapes_;
  context.pool = &pool;
  context.meshes = &meshes_;
  return context;
}

}  // namespace prescene::service
