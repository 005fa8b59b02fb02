// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/infer_release.h"

#include <algorithm>
#include <memory>

#include "falling_particles.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {
namespace {

/// Share of a new frame in the mean place in the hand, at least: a grip may creep.
constexpr double kLeastGripGain = 0.05;

constexpr int kSettledFrames = 3;  // where an object is in its hand is known after so many tracked frames

// An object has left its place in the hand when it is further from it than this, or turned further, and in either case
// by at least three of its standard deviations, in so many tracked frames in a row. Chosen.
constexpr double kLeftShift = 0.03;  // m
constexpr double kLeftTurn = 0.5;    // rad
constexpr int kLeftFrames = 3;

bool has_left(const Vector3d& shift, const Vector3d& turn, const geometry::Matrix6d& covariance) {
  const geometry::Vector6d deviation = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return shift.norm() > std::max(kLeftShift, 3.0 * deviation.tail<3>().maxCoeff()) ||
         turn.norm() > std::max(kLeftTurn, 3.0 * deviation.head<3>().maxCoeff());
}

/// Whether the object left the hand in this frame for good.
bool follow_grip(const belief::Belief& belief, const belief::ObjectBelief& object, const Pose& X_WG,
                 belief::GripRecord& grip) {
  if (object.state != belief::TrackState::kTracked) return false;
  const belief::ObjectEstimate estimate = belief::estimate(belief, object);
  const geometry::SymmetryGroup& symmetry = belief::model_of(belief, object).symmetry;
  if (grip.frames == 0) {
    grip = {X_WG.inverse() * estimate.mean, 1, 0};
    return false;
  }
  const Pose X_GO = geometry::closest_equivalent(X_WG.inverse() * estimate.mean, grip.X_GO, symmetry);
  const geometry::Vector6d moved = geometry::box_minus(X_GO, grip.X_GO);
  if (!has_left(moved.tail<3>(), moved.head<3>(), estimate.covariance)) {
    grip.apart_frames = 0;
    const double gain = std::max(1.0 / ++grip.frames, kLeastGripGain);
    grip.X_GO = geometry::normalized(geometry::box_plus(grip.X_GO, gain * moved));
    return false;
  }
  if (grip.frames < kSettledFrames) {  // it was not known well where it is
    grip = {X_GO, 1, 0};
    return false;
  }
  return ++grip.apart_frames >= kLeftFrames;
}

}  // namespace

int infer_releases(const PredictOptions& options, belief::Belief& belief) {
  int released = 0;
  for (std::size_t i = 0; i < belief.objects.size(); ++i) {
    belief::ObjectBelief& object = belief.objects[i];
    const std::optional<int> hand = holder_of(*belief.scene, static_cast<int>(i));
    if (!hand) {
      object.grip = {};
      continue;
    }
    if (!follow_grip(belief, object, belief.robot[static_cast<std::size_t>(*hand)], object.grip)) continue;
    auto scene = std::make_shared<belief::Scene>(*belief.scene);
    scene->objects[i].held_by.reset();
    belief.scene = std::move(scene);
    object.grip = {};
    for (belief::Particle& particle : object.particles)
      if (particle.mode == belief::MotionMode::kHeld) wake(options, particle);
    ++released;
  }
  return released;
}

}  // namespace prescene::filter
