// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/wander.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "hidden_places.h"
#include "particle_update.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::Particle;

constexpr double kMovedAfter = 1.0;     // s; on average, by what hides it and is not known
constexpr double kMostlyUnknown = 0.5;  // share of its pixels in view that something unknown hides
constexpr double kWanderTurn = 0.3;     // rad; things are moved more often than turned over
constexpr int kWanderDraws = 12;        // places that are tried for each
constexpr double kLeftAlone = 0.75;     // the probability that it stays, however long it is hidden; chosen
constexpr double kOnePlace = 0.05;      // m

bool is_near(const SearchTarget& target, const Pose& A, const Pose& B) {
  return (A * target.centre() - B * target.centre()).norm() < kOnePlace;
}

/// The particle about which most of the weight is.
std::size_t leader_of(const SearchTarget& target, const std::vector<Particle>& particles) {
  std::size_t leader = 0;
  double most = 0.0;
  for (std::size_t i = 0; i < particles.size(); ++i) {
    double mass = 0.0;
    for (const Particle& other : particles)
      if (is_near(target, other.X_WO, particles[i].X_WO)) mass += std::exp(other.log_weight);
    if (mass > most) most = mass, leader = i;
  }
  return leader;
}

/// A particle that lies where the object lay when it was seen last: one that there is, or a new one that physics lets
/// down.
Particle left_alone(const SearchTarget& target, const Pose& X_still, const InitialiseOptions& spread,
                    const core::RandomStream& stream, const std::vector<Particle>& particles) {
  for (const Particle& particle : particles)
    if (particle.mode == belief::MotionMode::kResting && is_near(target, particle.X_WO, X_still)) return particle;
  return particles_about(X_still, belief::MotionMode::kMoving, 1, spread, stream).front();
}

}  // namespace

int wander_unseen(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                  const rendering::PoseEvidence& evidence, double dt, const WeightOptions& weighting,
                  const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
                  ObjectBelief& object) {
  if (object.state != belief::TrackState::kUnseen) return 0;
  const bool is_known = object.motion.still_frames > 0;
  const Particle& leader = object.particles[leader_of(target, object.particles)];
  if (leader.mode == belief::MotionMode::kHeld) return 0;
  const Pose X_last = is_known ? object.motion.X_still : leader.X_WO;
  const bool is_there = is_near(target, X_last, belief::heaviest(object.particles).X_WO);
  const rendering::PoseEvidence there =
      is_there ? evidence : evidence_of(terms, hypothesis(target, frame.X_CW * X_last), tools);
  if (there.measured - there.visible < kMostlyUnknown * there.in_view) return 0;
  const double unseen = 1e-9 * static_cast<double>(std::max<core::TimeNs>(0, frame.stamp_ns - object.last_seen_ns));
  const double probability = 1.0 - std::exp(-dt / kMovedAfter);
  core::RandomStream chances = stream.for_purpose(core::Purpose::kProcessNoise);
  std::vector<std::size_t> moved;
  for (std::size_t i = 0; i < object.particles.size(); ++i) {
    const bool is_redrawn = chances.uniform() < probability, is_left_alone = chances.uniform() < kLeftAlone;
    Particle& particle = object.particles[i];
    if (!is_redrawn || particle.mode != belief::MotionMode::kResting) continue;
    if (!is_left_alone) {
      moved.push_back(i);
    } else if (is_known) {
      const double log_weight = particle.log_weight;
      particle = left_alone(target, X_last, spread, stream, object.particles);
      particle.log_weight = log_weight;
    }
  }
  const HiddenReach reach = {hidden_shift(unseen), kWanderTurn, Vector3d::Zero()};
  const std::vector<Pose> places =
      hidden_places(frame, terms, target, X_last, reach, kWanderDraws * static_cast<int>(moved.size()), weighting,
                    tools, stream.for_purpose(core::Purpose::kProposal));
  const std::size_t count = std::min(moved.size(), places.size());
  for (std::size_t i = 0; i < count; ++i) {
    Particle& particle = object.particles[moved[i]];
    const double log_weight = particle.log_weight;
    particle = particles_about(places[i], belief::MotionMode::kMoving, 1, spread, stream).front();
    particle.log_weight = log_weight;
  }
  return static_cast<int>(count);
}

}  // namespace prescene::filter
