// SPDX-License-Identifier: Apache-2.0
// Scenes of free rigid bodies by MuJoCo [Todorov et al. 2012]: an independent engine for whole scenes.
//
// What differs from ours: contacts are springs with critical damping that sink in by tenths of a millimetre, friction
// creeps, a bounce is a spring with less damping, and cylinders and hulls have up to four contacts found by nudging.
#pragma once

#include <memory>

#include "prescene/belief/scene.h"
#include "prescene/belief/trajectory.h"

namespace prescene::tests {

struct MujocoOptions {
  double step = 5e-4;           ///< s
  double contact_time = 0.002;  ///< Time constant of contacts (solref), s; at least two steps. Of bounces half.
  double impedance_ratio = 10;  ///< Of friction to normal directions: higher creeps less.
  bool elliptic_cone = true;    ///< Else friction pyramids.
  double rest_time = 0.0;       ///< s: runs end when nothing moved for so long; 0: they are never cut short.
};

/// Objects and supports of primitives and convex hulls; no robot, no actions. Friction and restitution are those of the
/// start, multiplied with the other body's; masses and centres of mass must be certain.
class MujocoScene {
 public:
  explicit MujocoScene(const belief::Scene& scene, const MujocoOptions& options = {});
  ~MujocoScene();
  MujocoScene(MujocoScene&&) noexcept;

  /// First and last state, no contacts; kDiverged where it blew up. Nothing moves where no point of an object is faster
  /// than 2 mm/s. One call at a time.
  belief::Trajectory run(const belief::WorldState& start, double duration);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// How a spring and damper bounce: the damping ratio for which what meets it without gravity leaves when their sum
/// stops pushing, with this share of its speed.
double damping_ratio_of(double restitution);

}  // namespace prescene::tests
