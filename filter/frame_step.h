// SPDX-License-Identifier: Apache-2.0
// What the operators of one step share.
#pragma once

#include <optional>
#include <vector>

#include "prescene/filter/particle_filter.h"
#include "prescene/filter/proposals/fine_frame.h"

namespace prescene::filter {

inline const belief::ObjectModel& model_of(const belief::Belief& belief, std::size_t object) {
  return belief::model_of(belief, belief.objects[object]);
}

/// Share of an object's pixels that a camera shows from which its turn is looked at.
inline constexpr double kMostlySeen = 0.5;

struct ParticleFilter::FrameStep {
  const FilterFrame& frame;
  const belief::Observation& observation;
  StepResult& result;
  double dt = 0.0;  ///< Since the last frame of any camera, s; 0 in the first.
  // By object.
  std::vector<geometry::DepthImage> depths = {};  ///< What others may be hidden by.
  std::vector<WeightReport> reports = {};
  std::vector<Island> islands = {};    ///< Whose particles are worlds.
  std::optional<FineFrame> fine = {};  ///< Made where it is asked for.

  belief::Belief& belief() const { return result.belief; }
  TrackedBy by() const { return {result.belief.cameras, observation.camera, observation.stamp_ns}; }
  /// Whether the frame shows the object, once it was weighed.
  bool shows(std::size_t object) const { return is_shown_by(result.belief.objects[object], observation.camera); }
  /// Of this camera.
  std::uint64_t frame_number() const { return frames_of(result.belief, observation.camera); }
  const belief::Particle& heaviest(std::size_t object) const {
    return belief::heaviest(result.belief.objects[object].particles);
  }
};

}  // namespace prescene::filter
