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
  /// With woken: it is seen, so that it keeps its pose unless something pushes it.
  bool keeps_pose = false;
  /// If nothing shows where it goes: its covariance if it has not moved. Physics that leaves it where it is adds no
  /// doubt.
  std::optional<belief::Matrix12d> covariance_at_rest = std::nullopt;
};

/// The worlds of one island in a step.
struct WorldsOfIsland {
  Island members;
  std::vector<double> log_weights;                    ///< Before the step.
  std::vector<std::vector<belief::Particle>> starts;  ///< By member: particles with the modes of this step, unmoved.
  std::vector<double> draws;                          ///< By world: whether it is simulated.
  std::vector<Falling> may_fall;  ///< What moves in worlds of which it alone would not be simulated.
  bool apart = false;             ///< A member is released: each is for itself.

  void begin(std::size_t object, bool released, const belief::ObjectBelief& now);
  double shared_draw(std::size_t world, double own);
  /// Where one member of a world is simulated, all that move are.
  void fall_together(belief::Belief& belief, std::vector<Falling>& falling);
  /// Of a member in a world; null = it is none.
  const belief::Particle* start_of(std::size_t object, std::size_t world) const;
};
struct Worlds {
  std::vector<WorldsOfIsland> islands;
  WorldsOfIsland* of(std::size_t object);
  const WorldsOfIsland* of(std::size_t object) const;
};
Worlds worlds_of(const belief::Belief& belief, std::span<const Island> islands);

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
/// Starts to move: at its velocity, with room for more; for `share` of what the options say.
void wake(const PredictOptions& options, belief::Particle& particle, double share = 1.0);

/// Leaves of a scene's joints those whose things it still has. A hand pulls what is on a joint, and does not carry it.
void keep_joints_of_present(belief::Scene& scene);

/// Moves all falling particles on to the end of the step: by physics where that can be done, else at constant velocity.
PredictReport move_on(belief::Belief& belief, std::vector<Falling> falling, const Worlds& worlds,
                      std::span<const Pose> X_WG, double dt, const PredictOptions& options, const PredictTools& tools);

}  // namespace prescene::filter
