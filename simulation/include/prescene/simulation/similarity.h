// SPDX-License-Identifier: Apache-2.0
// Small and large things are simulated as the similar things of household size: lengths change by a factor, times by
// its square root, while gravity and masses stay. Mechanics of rigid bodies with Coulomb friction and Newton's
// restitution has no length of its own, so that what happens is the same by Froude similarity [Bridgman 1922]. Every
// length, speed, time and energy that a stepper has settings or constants for then fits the things, whatever their
// size.
//
//   const Similarity similarity = similarity_of(scene);   // a die of 1 cm: lengths 0.1
//   if (similarity.length != 1.0) simulator = make_scaled_simulator(std::move(simulator), similarity);
#pragma once

#include <memory>

#include "prescene/belief/scene_size.h"
#include "prescene/simulation/simulator.h"

namespace prescene::simulation {

/// True sizes and times over simulated ones.
struct Similarity {
  double length = 1.0;
  double time() const;
  /// From simulated to true, and back.
  Similarity inverse() const { return {1.0 / length}; }
  friend bool operator==(const Similarity&, const Similarity&) = default;
};

/// m: the size of a thing that the steppers' settings are made for.
inline constexpr double kReferenceSize = belief::kHouseholdSize;
/// m: things from the first to the second size are simulated as they are.
inline constexpr double kSmallestAsItIs = 0.05, kLargestAsItIs = 0.3;

/// By belief::smallest_size() over kReferenceSize; 1 for things of household size.
Similarity similarity_of(const belief::Scene& scene);

/// All lengths are multiplied by `similarity.length`, all times by similarity.time(). Outcomes, camera and colours are
/// left as they are: simulators do not look at them.
belief::Scene scaled(const belief::Scene& scene, const Similarity& similarity);
belief::Action scaled(const belief::Action& action, const Similarity& similarity);
belief::WorldState scaled(const belief::WorldState& state, const Similarity& similarity);
/// Impulses are those of unchanged masses.
void scale(const Similarity& similarity, belief::Trajectory& trajectory);

/// `simulator` is of scaled(scene, similarity.inverse()); what comes out takes and gives true lengths and times.
std::unique_ptr<Simulator> make_scaled_simulator(std::unique_ptr<Simulator> simulator, const Similarity& similarity);

}  // namespace prescene::simulation
