// SPDX-License-Identifier: Apache-2.0
// Chooses the stepper, who scores poses and who renders. The stepper is Bullet's or the lockstep stepper, poses are
// scored by the processor or a graphics card, and the reference renderer draws what is recorded or answered. Collision
// shapes and meshes are made once and kept.
//
//   Backends backends(pool);
//   auto simulator = backends.make_simulator(scene);
//   belief::Answer answer = queries::answer(snapshot, query, backends.query_context(pool));
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/filter/proposals/render_scene.h"
#include "prescene/queries/query_engine.h"
#include "prescene/rendering/gpu/likelihood_choice.h"
#include "prescene/rendering/renderer.h"
#include "prescene/simulation/bullet/bullet_simulator.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simulator.h"

namespace prescene::service {

/// Who simulates (docs/reference/simulation.md).
enum class Stepper {
  kBullet,
  kAutomatic,  ///< In lockstep where scene and actions allow it, else Bullet, which is counted (StepperCounts).
  kLockstep,   ///< In lockstep; scenes and actions that it can't simulate are refused with the reason.
};

/// Who simulated so far, where lockstep was to be taken if it can.
struct StepperCounts {
  std::uint64_t lockstep = 0;        ///< Simulators made that step in lockstep.
  std::uint64_t bullet_instead = 0;  ///< Simulators, or runs of one, that Bullet's stepper had to take over.
  std::string last_reason;           ///< Why it had to, the last time.
};

struct BackendSettings {
  simulation::BulletOptions bullet;
  /// The two differ by rounding. Chaos amplifies rounding differences, so single runs differ while probabilities agree.
  Stepper stepper = Stepper::kAutomatic;
  /// Who scores poses; the same bits whoever does.
  rendering::LikelihoodChoice likelihood;
};

/// Safe to use from several threads.
class Backends {
 public:
  /// `pool` must outlive the backends.
  explicit Backends(core::ThreadPool& pool, const BackendSettings& settings = {});

  core::ThreadPool& pool() { return pool_; }
  filter::MeshCache& meshes() { return meshes_; }

  /// Its steps are `step_factor` (> 0) times as long as the scene says, or else BackendSettings::bullet. Things that
  /// are smaller or larger than those of a household are simulated as similar ones that are not
  /// (prescene/simulation/similarity.h): the settings are then theirs. Simulator::stepper() says who it is. Fails as
  /// make_bullet_simulator does: kInvalidInput for shapes without thickness and for a step out of range, kUnsupported
  /// for a triangle surface that moves. With Stepper::kLockstep, kUnsupported names what of the scene can't be
  /// simulated in lockstep.
  core::Result<std::unique_ptr<simulation::Simulator>> make_simulator(const belief::Scene& scene,
                                                                      double step_factor = 1.0);
  /// The same as a function; the backends must outlive it.
  simulation::SimulatorFactory simulator_factory();
  StepperCounts stepper_counts() const;
  /// Fails as rendering::make_likelihood_batch does for BackendSettings::likelihood.
  core::Result<std::unique_ptr<rendering::LikelihoodBatch>> make_likelihood();
  /// The reference renderer, of deterministic bits: what is recorded, replayed or answered is drawn by it. Never fails.
  core::Result<std::unique_ptr<rendering::Renderer>> make_renderer();
  /// For queries that run in `pool`.
  queries::QueryContext query_context(core::ThreadPool& pool);

 private:
  class StepperLog;

  core::Result<std::unique_ptr<simulation::Simulator>> make_simulator_as_it_is(
      const belief::Scene& scene, const simulation::BulletOptions& options);

  core::ThreadPool& pool_;
  BackendSettings settings_;
  std::shared_ptr<StepperLog> stepper_log_;
  simulation::ShapeStore shapes_;
  filter::MeshCache meshes_;
};

}  // namespace prescene::service
