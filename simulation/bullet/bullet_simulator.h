// SPDX-License-Identifier: Apache-2.0
// The simulator on Bullet 3.24 in double precision: its rigid bodies and sequential impulse solver, with contact
// finding and contact rows that keep true sizes, lose no restitution and rub in the direction of the slip.
// docs/simulation.md says what differs from plain Bullet and what was measured.
//
//   ShapeStore shapes(hacd_decomposer());
//   PRESCENE_TRY(auto simulator, make_bullet_simulator(scene, shapes, BulletOptions{}));
#pragma once

#include <memory>

#include "prescene/core/status.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

struct BulletOptions {
  /// Length of a step, s, in [1e-5, 0.02]. Free flight is exact at any step; impacts and friction are better at 1/1000
  /// (real cube tosses: see docs/accuracy.md), some four times as dear as 1/240.
  double step = 1.0 / 240.0;
  /// Most iterations of the contact solver a step, in [1, 1000]; it stops earlier once nothing changes.
  int solver_iterations = 60;
  /// m/s: the solver stops when no contact's velocity changes by more in an iteration; > 0.
  double solver_accuracy = 1e-6;
  /// Share of an overlap that a step takes away, in (0, 1]; it adds no energy.
  double overlap_recovery = 0.2;
  /// m/s: contacts that close slower do not bounce; >= 0.
  double restitution_speed = 0.02;
  /// m/s: contacts that close faster rub with impact_friction, slower ones with friction; >= 0.
  double impact_speed = 0.2;
  /// Smallest radius of edges and corners, m, in [1e-5, 0.01]; models may ask for more
  /// (ContactProperties::edge_radius). Faces keep their true place.
  double edge_rounding = 2e-4;
  /// Two shapes nearer than this touch, for contact intervals and final contacts, m; >= 0.
  double touching_distance = 2e-4;
  /// Contacts that part for less than this are one interval, s; >= 0.
  double contact_merge_time = 0.02;
  /// Steps in which nothing can touch anything are taken without looking for contacts; the same bits either way.
  bool skip_flight = true;
  RestRule rest;
  DecompositionSettings decomposition;
};

/// Ranges of the options: the message names the field.
core::Status validate(const BulletOptions& options);

/// Builds the scene's shapes (through `shapes`, which must live as long as this call). Fails with kInvalidInput for
/// shapes without thickness or options out of range, and kUnsupported for a triangle surface on an object that moves.
/// Supports' and robot bodies' friction and restitution are taken at their means; the objects' come with each state.
core::Result<std::unique_ptr<Simulator>> make_bullet_simulator(const belief::Scene& scene, ShapeStore& shapes,
                                                               const BulletOptions& options = {});

}  // namespace prescene::simulation
