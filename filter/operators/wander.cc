// SPDX-License-Identifier: Apache-2.0
#include "prescene/filter/operators/wander.h"

#include <algorithm>
#include <cmath>

#include "hidden_places.h"

namespace prescene::filter {
namespace {

using belief::ObjectBelief;
using belief::Particle;

constexpr double kMovedAfter = 1.0;     // s; on average, by what hides it and is not known
constexpr double kMostlyUnknown = 0.5;  // share of its pixels in view that something unknown hides
constexpr double kWanderTurn = 0.3;     // rad; things are moved more often than turned over
constexpr int kWanderDraws = 12;        // places that are tried for each

}  // namespace

int wander_unseen(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                  const rendering::PoseEvidence& evidence, const WeightOptions& weighting,
                  const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
                  ObjectBelief& object) {
  if (object.state != belief::TrackState::kUnseen || object.frames_unseen <= 0) return 0;
  if (evidence.measured - evidence.visible < kMostlyUnknown * evidence.in_view) return 0;
  const Particle last = belief::heaviest(object.particles);
  if (last.mode == belief::MotionMode::kHeld) return 0;
  const double unseen = 1e-9 * static_cast<double>(std::max<core::TimeNs>(0, frame.stamp_ns - object.last_seen_ns));
  const double probability = 1.0 - std::exp(-unseen / object.frames_unseen / kMovedAfter);
  core::RandomStream chances = stream.for_purpose(core::Purpose::kProcessNoise);
  std::vector<std::size_t> moved;
  for (std::size_t i = 0; i < object.particles.size(); ++i)
    if (chances.uniform() < probability && object.particles[i].mode == belief::MotionMode::kResting) moved.push_back(i);
  if (moved.empty()) return 0;
  const HiddenReach reach = {hidden_shift(unseen), kWanderTurn, Vector3d::Zero()};
  const std::vector<Pose> places =
      hidden_places(frame, terms, target, last.X_WO, reach, kWanderDraws * static_cast<int>(moved.size()), weighting,
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
