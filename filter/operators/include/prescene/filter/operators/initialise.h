// SPDX-License-Identifier: Apache-2.0
// Operator 1, initialise: the first belief, from what the scene says of each object's start or, where it says too
// little, from the first frame alone: supports, clusters that they do not explain, poses proposed per model, refined.
//
//   belief::Belief belief = belief_from_priors(scene, seed, stamp_ns, options);  // no frame needed
//   find_in_frame(frame, observation, options, tools, stream, belief);  // objects whose place the scene leaves open
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/frame.h"

namespace prescene::filter {

/// Of an object when it is found. Chosen.
inline constexpr double kFoundExistence = 0.9;

struct InitialiseOptions {
  /// count. Each object has this many particles. Range 1 to 1000. Measured: docs/studies/tracking.md.
  int particles = 16;
  /// m. After a find, the particles' positions are drawn with this standard deviation. Range 0.0001 to 0.1. Chosen.
  double first_shift = 0.006;
  /// rad. After a find, the particles' rotations are drawn with this standard deviation. Range 0.001 to 1. Chosen.
  double first_turn = 0.06;
  /// probability. An object that the scene names and places is there with this probability before the first frame.
  /// Range 0 to 1. Chosen.
  double prior_existence = 0.95;
  /// switch. Supports that the frame shows and the scene does not name are added to the belief's scene, if the scene
  /// names none or objects are looked for. Range true or false. Chosen.
  bool add_support = true;
  /// Used to look for objects in the first frame; its segmentation is used for supports, too.
  DetectionOptions detection;
};

/// Draws each object's particles from the scene's priors; one set a scene object, in its order. Step 0.
belief::Belief belief_from_priors(std::shared_ptr<const belief::Scene> scene, std::uint64_t seed, core::TimeNs stamp_ns,
                                  const InitialiseOptions& options);

/// Whether the scene leaves the object's place or rotation too open to start from: a standard deviation along or about
/// some axis is more than 6 cm or 0.5 rad. Such an object is looked for in the first frame. Never of an object that is
/// held.
bool has_wide_prior(const belief::SceneObject& object);

/// Log of the probability, by the scene's prior alone, that the object is turned by kRivalTurn or more from where the
/// scene says, about the axis that it is least sure of; at least kSlipLogOdds. 0 of what is looked for in the first
/// frame, which may be found at any turn.
double turned_log_odds(const belief::SceneObject& object);

/// The supports that the frame shows and the scene does not know, each as a box of its plane's extent, the one that
/// most pixels show first. Gravity says what is up; what is no larger than a face of the scene's models is not taken
/// for one.
std::vector<belief::Support> supports_from_frame(const SampledDepth& sampled, const Pose& X_WC,
                                                 const belief::Scene& scene, const InitialiseOptions& options,
                                                 MeshCache& meshes, const core::RandomStream& stream);

struct FindReport {
  int looked_for = 0;
  int found = 0;
  bool no_support = false;  ///< Nothing to stand on was seen, so nothing could be looked for.
};
/// Which of the objects with wide priors are looked for.
enum class FindWhich {
  kAll,  ///< In the first frame of all.
  kLost  ///< Those that are lost, in the first frame of another camera; the others are what is known to be there.
};
/// Looks for objects with wide priors. Those found get particles there, the others are lost until they are seen.
FindReport find_in_frame(const FilterFrame& frame, const belief::Observation& observation,
                         const InitialiseOptions& options, const FilterTools& tools, const core::RandomStream& stream,
                         belief::Belief& belief, FindWhich which = FindWhich::kAll);

/// What objects can stand on in a frame: the scene's supports and what else the frame shows.
Surroundings surroundings_in(const FilterFrame& frame, const SampledDepth& sampled, const belief::Scene& scene,
                             std::span<const WantedModel> wanted, const SegmentationOptions& options,
                             const core::RandomStream& stream);

/// `count` particles about a pose of known spread: the first at the pose itself, at rest.
std::vector<belief::Particle> particles_about(const Pose& X_WO, belief::MotionMode mode, int count,
                                              const InitialiseOptions& options, core::RandomStream stream);

}  // namespace prescene::filter
