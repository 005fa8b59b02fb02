// SPDX-License-Identifier: Apache-2.0
// The vector kernel of continuous_sphere_queries.h: descent of two sphere trees while one moves.
#pragma once

#include <array>
#include <cstdint>

#include "prescene/collision/screw_motion.h"
#include "prescene/collision/spheres/continuous_sphere_queries.h"
#include "prescene/collision/spheres/sphere_tree.h"

namespace prescene::collision {

/// B's spheres move along straight lines from `start` to `end`; they may leave them by |bend c + bend_offset| +
/// turned radius, with c the centre in B.
struct Sweep {
  Transform start;
  Transform end;
  bool bent = false;
  std::array<float, 9> bend{};
  std::array<float, 3> bend_offset{};
  float turned = 0.0F;

  /// The part of a screw between two times.
  void set_bend(const ScrewMotion& motion, double from, double to);
};

/// What happens to pairs of spheres that the kernel finds.
class SweptPairs {
 public:
  virtual ~SweptPairs() = default;
  /// Looks at the spheres at two places of the trees' orders. Returns the time, as a share of the sweep, after which no
  /// contact is of interest any more.
  virtual double meet(std::uint32_t place_a, std::uint32_t place_b) = 0;
};

/// Calls pairs->meet for all pairs of spheres that may meet before the time that it returned last, some that do not,
/// and none twice. Near ones first.
void sweep(const SphereTree& a, const SphereTree& b, const Sweep& motion, SweepScratch* scratch, SweptPairs* pairs);

}  // namespace prescene::collision
