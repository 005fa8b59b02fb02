// SPDX-License-Identifier: Apache-2.0
// A simulator for many instances of one scene in which one to 16 rigid bodies meet each other, fixed surroundings and
// what a robot moves: 8 to 16 instances at once in the lanes of vectors. Physics as in prescene/simulation/bullet
// (docs/reference/simulation.md), restated; what a scene has beyond it the factory refuses, so that callers take that
// simulator.
//
//   PRESCENE_TRY(auto simulator, make_lockstep_simulator(scene, shapes, LockstepOptions{}));
//
// Instances that are in the same stage of a step (flying, near a plane, near a box, being solved) share a vector, in
// whatever order they come; no operation mixes lanes, and none is fused. An instance's bits therefore depend neither on
// which others are simulated with it, nor on threads, nor on the instruction set.
#pragma once

#include <memory>

#include "prescene/core/status.h"
#include "prescene/simulation/rules/mechanics_options.h"
#include "prescene/simulation/shape_store.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

struct LockstepOptions : MechanicsOptions {
  /// As in BulletOptions, but >= 1e-7: impulses are single precision.
  double solver_accuracy = 2e-6;
  /// Instances that a thread has under way at once, in [1, 1024]. More fill the vectors better; memory grows by
  /// 4.5 KiB each with one object, 10 with two that are pushed.
  int live_instances = 256;
};

/// Ranges of the options: the message names the field.
core::Status validate(const LockstepOptions& options);

/// Fails with kInvalidInput as make_bullet_simulator does, and with kUnsupported, naming body and reason, unless the
/// scene has
///   - one to 16 objects of boxes, spheres, cylinders, cones, capsules and hulls (convex_hull, convex_parts,
///     decompose), and at most 16 parts each. Hulls of more than 64 vertices, or with sides of more than 16 corners,
///     are simplified (prescene/simulation/simplified_polytope.h); StepperUse::hull_error says by how much;
///   - supports of the same shapes, at most 256 parts together;
///   - robot bodies of the same shapes, at most 16 parts each and 32 bodies with a shape;
///   - at most 16 push actions. Simulator::supports() says the same of a request's actions.
core::Result<std::unique_ptr<Simulator>> make_lockstep_simulator(const belief::Scene& scene, ShapeStore& shapes,
                                                                 const LockstepOptions& options = {});

}  // namespace prescene::simulation
