// SPDX-License-Identifier: Apache-2.0
// What all our simulators of rigid bodies understand alike.
//
//   MechanicsOptions options;
//   options.step = 1e-3;  // s: finer than the default, for impacts
//   PRESCENE_RETURN_IF_ERROR(validate(options));
#pragma once

#include "prescene/core/status.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

struct MechanicsOptions {
  /// Length of a step, s, in [1e-5, 0.02]. Free flight is exact at any step; impacts and friction are better at 1/1000
  /// (real cube tosses: see docs/studies/accuracy.md), some four times as dear as 1/240.
  double step = 1.0 / 240.0;
  /// Most iterations of the contact solver a step, in [1, 1000]; it stops earlier once nothing changes.
  int solver_iterations = 60;
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
  RestRule rest;
  DecompositionSettings decomposition;
};

/// Ranges of the options: the message names the field.
core::Status validate(const MechanicsOptions& options);

}  // namespace prescene::simulation
