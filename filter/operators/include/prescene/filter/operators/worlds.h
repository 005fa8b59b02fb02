// SPDX-License-Identifier: Apache-2.0
// Particles that are worlds. Objects that may touch form an island. While something in an island changes, particle i of
// each of its members belongs to the same world: worlds are predicted together, weighed together and resampled
// together. When the members part, or all come to rest, their sets are independent again, as they are: weights of
// worlds are the marginal weights of each member's particles.
//
//   const std::vector<Island> islands = islands_that_change(belief, dt, options, touch, pool);
//   for (const Island& island : islands) join_worlds(island, resampling, stream, belief);
//   predict(belief, control, X_WG, dt, predicting, {simulators, bounds, stream, pool}, islands);
//   for (const Island& island : islands) combine_weights(island, log_weights_before, belief);  // weighed in between
//   for (const Island& island : islands) resample_worlds(island, resampling, stream, belief);
//
// Nothing but the particles is carried from frame to frame. Sets whose weights are the same bit for bit are the members
// of worlds; whatever changes the weights of one of them alone (a rival turn that is held, a place that was found) ends
// that, and join_worlds() draws worlds from the product anew.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/filter/operators/resample.h"

namespace prescene::collision {
class SphereTree;
}

namespace prescene::filter {

struct WorldsOptions {
  /// switch. Particles of objects that may touch and of which one moves, or is held to be turned in several ways, are
  /// worlds. Range true or false. Measured: docs/studies/tracking.md.
  bool joint = false;
  /// count. An island has at most so many members; of what touches beyond that, every object is for itself. Range 2 to
  /// 8. Chosen.
  int most_members = 4;
  /// share. An island changes when at least this share of an object's weight moves, or is turned otherwise than its
  /// heaviest particle. Range 0 to 1. Chosen.
  double least_change = 0.1;
};

/// Indices of the belief's objects, ascending, two or more.
using Island = std::vector<std::size_t>;

/// Whether two objects may touch: by the inner sphere trees of their models, whose poses are Gaussian. Trees are made
/// on first use and kept; models that no spheres fit into are taken for the balls about them.
class TouchTest {
 public:
  TouchTest();
  ~TouchTest();
  /// Within `reach` (m) of each other, in addition to what is uncertain.
  bool may_touch(const belief::Belief& belief, std::size_t a, std::size_t b, double reach, core::ThreadPool& threads);

 private:
  const collision::SphereTree* tree_of(const belief::ObjectModel& model, core::ThreadPool& threads);
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

/// Whether the weight of what moves, or of what is turned against the heaviest particle, is at least `least_change`.
bool may_change(const belief::Belief& belief, std::size_t object, double least_change);

/// The islands of present objects with equally many particles, of which a member may change. `dt`: until the next
/// frame, s; what moves towards each other that fast touches. Hands and supports move as is known: they are part of
/// what an island is simulated with, and join no objects.
std::vector<Island> islands_that_change(const belief::Belief& belief, double dt, const WorldsOptions& options,
                                        TouchTest& touch, core::ThreadPool& threads);

/// Whether the members' particles are worlds: their weights are the same, bit for bit.
bool are_worlds(const belief::Belief& belief, const Island& island);

/// Makes worlds of the members' particles where they are none: as many as there are, drawn from the product of the
/// sets, the likeliest first. Sets that are worlds already stay together. Returns whether it did anything.
bool join_worlds(const Island& island, const ResampleOptions& options, const core::RandomStream& stream,
                 belief::Belief& belief);

/// The log weights of the members, which are all the same.
std::vector<double> world_weights(const belief::Belief& belief, const Island& island);

/// Each member's weights changed from `before` by what concerns it alone: those of worlds change by the product, and
/// each member's turns weigh what its own evidence says. False when all were impossible and were made equal.
bool combine_weights(const Island& island, const std::vector<double>& before, belief::Belief& belief);

/// resample_within_turns() for worlds: what differs in the turn of any member is kept apart.
bool resample_worlds(const Island& island, const ResampleOptions& options, const core::RandomStream& stream,
                     belief::Belief& belief);

}  // namespace prescene::filter
