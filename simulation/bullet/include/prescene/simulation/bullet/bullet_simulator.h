// SPDX-License-Identifier: Apache-2.0
// The simulator on Bullet 3.24 in double precision: its rigid bodies and sequential impulse solver, with contact
// finding and contact rows that keep true sizes, lose no restitution and rub in the direction of the slip.
// docs/reference/simulation.md says what differs from plain Bullet and what was measured.
//
//   ShapeStore shapes(hacd_decomposer());
//   PRESCENE_TRY(auto simulator, make_bullet_simulator(scene, shapes, BulletOptions{}));
#pragma once

#include <memory>

#include "prescene/core/status.h"
#include "prescene/simulation/rules/mechanics_options.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

struct BulletOptions : MechanicsOptions {
  /// m/s: the solver stops when no contact's velocity changes by more in an iteration; >= 1e-15.
  double solver_accuracy = 1e-6;
  /// Steps in which nothing can touch anything are taken without looking for contacts; the same bits either way.
  bool skip_flight = true;
};

/// Ranges of the options: the message names the field.
core::Status validate(const BulletOptions& options);

/// Builds the scene's shapes (through `shapes`, which must live as long as this call). Fails with kInvalidInput for
/// shapes without thickness or options out of range, and kUnsupported for a triangle surface on an object that moves.
/// Supports' and robot bodies' friction and restitution are taken at their means; the objects' come with each state.
core::Result<std::unique_ptr<Simulator>> make_bullet_simulator(const belief::Scene& scene, ShapeStore& shapes,
                                                               const BulletOptions& options = {});

}  // namespace prescene::simulation
