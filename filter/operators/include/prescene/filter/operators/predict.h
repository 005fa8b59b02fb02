// SPDX-License-Identifier: Apache-2.0
// Operator 2, predict: what each particle does until the next frame. Resting stays, held moves with its hand, moving
// goes on at constant velocity or falls by the laws of physics (a part of the particles each, the frame decides); some
// particles change their mode. What physics cannot do goes on at constant velocity, and the report says so.
//
//   RobotBounds bounds;                                          // one for all steps
//   PredictReport report = predict(belief, control, X_WG_now, dt, options, {simulators, bounds, stream, pool});
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/operators/worlds.h"
#include "prescene/simulation/simulator.h"

namespace prescene::filter {

using belief::Pose;
using geometry::Vector3d;

/// Standard deviations that are added within one second, as random walks: rates in m, rad per square root of a second.
struct MotionNoise {
  /// m per sqrt(s). Noise of the position. Range 0 to 0.5. Chosen.
  double shift;
  /// rad per sqrt(s). Noise of the rotation. Range 0 to 5. Chosen.
  double turn;
  /// m/s per sqrt(s). Noise of the velocity. Range 0 to 10. Chosen.
  double speed;
  /// rad/s per sqrt(s). Noise of the angular velocity. Range 0 to 100. Chosen.
  double rate;
};

struct PredictOptions {
  /// Noise of objects that rest and are not seen. For those that are seen it is much smaller. Chosen.
  MotionNoise resting = {.shift = 0.0006, .turn = 0.006, .speed = 0.0, .rate = 0.0};
  /// Noise of held objects, relative to the hand. Chosen.
  MotionNoise held = {.shift = 0.010, .turn = 0.08, .speed = 0.0, .rate = 0.0};
  /// Noise of moving objects. At 30 Hz this is 3 mm, 0.03 rad, 0.10 m/s and 0.8 rad/s in each frame. Objects whose
  /// velocity changes faster are often lost. Chosen.
  MotionNoise moving = {.shift = 0.0164, .turn = 0.164, .speed = 0.55, .rate = 4.4};
  /// share. A tracked object keeps this share of its velocity over one second. Range 0 to 1. Chosen.
  double velocity_keep = 0.55;
  /// share. An object that is not tracked keeps this share of its velocity over one second; with more it would drift
  /// away. Range 0 to 1. Measured: docs/studies/tracking.md.
  double unseen_velocity_keep = 2e-4;
  /// probability. In each frame, a held particle of a tracked object starts to move with this probability, and a
  /// resting one of an object that is tracked or doubtful with three times this probability. Range 0 to 1. Chosen.
  double wake_probability = 0.12;
  /// probability. In each frame, a moving particle of an object that the scene says is held moves with the hand again
  /// with this probability. Range 0 to 1. Chosen.
  double regrasp_probability = 0.5;
  /// probability. In each frame, a moving particle whose velocity is consistent with zero comes to rest with this
  /// probability. Range 0 to 1. Chosen.
  double settle_probability = 0.15;
  /// m/s. The velocity of a particle that starts to move is drawn with this standard deviation. Range 0 to 5. Chosen.
  double wake_speed = 0.15;
  /// rad/s. Its angular velocity is drawn with this standard deviation. Range 0 to 50. Chosen.
  double wake_rate = 1.0;
  /// share. This share of a tracked object's moving particles is simulated; the others go on at constant velocity. The
  /// same share of its resting ones is, where a robot body or an announced push may touch them; the others stay.
  /// Range 0 to 1. Chosen.
  double physics_share = 0.5;
};

/// What physics did in a step.
struct PredictReport {
  int simulated = 0;      ///< Particles that it simulated; what rests and is not pushed stays where it is.
  int not_simulated = 0;  ///< Particles that it was to move and could not; they went on at constant velocity.
  int pushed = 0;         ///< Particles at rest that a robot body, a push or another of their world set in motion.
  /// Why it could not move the first of these; "" = it moved all.
  std::string failure;
};

/// Boxes about the collision shapes of a scene's robot bodies. They are fixed in the bodies, so that each is worked out
/// once, and again only where a body's shapes are others. Not thread-safe.
class RobotBounds {
 public:
  /// The smallest box but for meshes that are turned in their body; empty where there are no shapes. `body`: its index.
  const geometry::Box& of(std::size_t body, const std::vector<belief::CollisionShape>& shapes);

 private:
  struct Known {
    std::vector<belief::CollisionShape> shapes;
    geometry::Box box;
  };
  std::vector<Known> known_;
};

/// What predict() works with.
struct PredictTools {
  /// Called once for each group of objects that may touch in the step, with a scene of these objects, and shapes should
  /// come from a cache; empty = none, then everything that moves does so at constant velocity.
  const simulation::SimulatorFactory& simulators;
  RobotBounds& robot_bounds;         ///< Kept from step to step.
  const core::RandomStream& stream;  ///< Draws of a step are those at the belief's step number.
  core::ThreadPool& threads;
};

/// Steps `belief` from its robot poses and stamp to `X_WG` and `dt` later (s, > 0). Actions of the control act at their
/// times within the step. Weights change with modes. A particle whose simulator can't be made, or whose run does not
/// last for the whole step or ends where nothing can be, goes on at constant velocity like those that are not meant for
/// physics.
///
/// `X_WG`: of all robot bodies, in the scene's order. `islands`: those whose particles are worlds (checked). What moves
/// in a world is simulated together, from where every member is in it, or not at all; what rests there and is pushed
/// begins to move. In a step in which a member is released each is for itself.
///
/// `keeps_modes`: by object; those of which nothing new is seen, so that whatever their particles do they go on doing.
/// Those beyond its end may change their modes.
PredictReport predict(belief::Belief& belief, const belief::Control& control, std::span<const Pose> X_WG, double dt,
                      const PredictOptions& options, const PredictTools& tools, std::span<const Island> islands = {},
                      const std::vector<bool>& keeps_modes = {});

/// One particle at constant velocity about the centre p_OQ for dt, its covariance grown by the noise.
void drift(belief::Particle& particle, const Vector3d& p_OQ, double dt, double velocity_keep, const MotionNoise& noise);

/// The body that holds an object now: held_by of its scene object.
std::optional<int> holder_of(const belief::Scene& scene, int object);

}  // namespace prescene::filter
