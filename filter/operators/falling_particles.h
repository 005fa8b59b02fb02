// SPDX-License-Identifier: Apache-2.0
// The part of predict() that physics does: particles that fall, slide and collide, among the objects that they may
// touch within the step.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "prescene/filter/operators/predict.h"
#include "prescene/filter/operators/track_state.h"

namespace prescene::filter {

/// One particle that physics is to move on.
struct Falling {
  std::size_t object;
  std::size_t particle;
  double duration;       ///< s
  Pose X_WO;             ///< Where constant velocity takes it, ...
  geometry::Twist V_WO;  ///< ... and how fast it is then.
  bool woken = false;    ///< It rested, and something may push it: it rests on where physics does not move it.
  /// If nothing shows where it goes: its covariance if it has not moved. Physics that leaves it where it is adds no
  /// doubt.
  std::optional<belief::Matrix12d> covariance_at_rest = std::nullopt;
};

/// The middle of an object, in O.
Vector3d centre_of(const belief::Scene& scene, const belief::ObjectBelief& object);
/// m, of the ball about that middle that holds it.
double radius_of(const belief::Scene& scene, const belief::ObjectBelief& object);
/// Takes velocity and what is known of it from a particle.
void clear_twist(belief::Particle& particle);
/// Slower than what settles.
bool is_slow(const belief::Particle& particle);
/// Lies from now on.
void settle(belief::Particle& particle);

/// Leaves of a scene's joints those whose things it still has. A hand pulls what is on a joint, and does not carry it.
void keep_joints_of_present(belief::Scene& scene);

/// Moves all falling particles on to the end of the step: by physics where that can be done, else at constant velocity.
PredictReport move_on(belief::Belief& belief, std::vector<Falling> falling, std::span<const Pose> X_WG, double dt,
                      const PredictOptions& options, const simulation::SimulatorFactory& simulators,
                      const core::RandomStream& stream, core::ThreadPool& threads);

}  // namespace prescene::filter
