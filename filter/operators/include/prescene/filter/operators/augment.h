// SPDX-License-Identifier: Apache-2.0
// Operator 3, augment: what the belief does not explain yet. Objects that are not supported by the frame are looked for
// in the whole image; clusters that no object explains may be new objects.
//
//   recover(frame, terms, target, current, options, weighting, spread, tools, stream, object);  // unseen or lost
//   new_objects(frame, observation, known, options, spread, tools, stream, belief);  // clusters that nothing explains
#pragma once

#include <array>
#include <span>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/frame.h"

namespace prescene::filter {

struct AugmentOptions {
  int recover_after_frames = 4;  ///< An object not supported for so many frames is looked for ...
  int recover_every = 3;         ///< ... every so many frames.
  /// An object that is tracked by less than this share of its pixels may be a wrong pose that the true one sticks out
  /// of: it is looked for too, every so many frames.
  double suspicious_share = 0.75;
  int suspicious_every = 10;
  int recover_starts = 48;
  double near_share = 0.33;  ///< Of the starts are near the last pose; the others at unexplained pixels.
  double near_shift = 0.08;  ///< m, standard deviation
  double near_turn = 0.8;    ///< rad
  SearchOptions search = {.refine = {.steps = 10}, .polish_candidates = 1, .polish_draws = 12};
  double accept_evidence = 3.0;    ///< Nats per visible pixel, outline considered.
  double accept_log_ratio = 40.0;  ///< nats
  double accept_visible_share = 0.08;
  double accept_hit_share = 0.5;  ///< Of the visible pixels.
  double min_gain = 10.0;         ///< nats more than where it was thought to be.
  /// Where motion could not have carried it since it was seen last (at this speed, m/s, and not less than 10 cm), a
  /// find needs this much more evidence per pixel.
  double reach_speed = 0.7;
  double far_evidence = 1.0;
  double injected_share = 0.5;  ///< Of the particles are put at the find, the least probable ones.
  double explained = 0.015;     ///< m; measurements so near to a known surface are explained.

  /// An object that the evidence speaks against may have gone where it cannot be seen: so many places about where it
  /// was and below it are tried, those that are hidden and free get this share of the particles.
  int hidden_draws = 160;
  double hidden_share = 0.25;
  double hidden_shift = 0.06;    ///< m, standard deviation of the places, ...
  double hidden_speed = 0.3;     ///< m/s; ... growing so fast while it was not seen ...
  double hidden_furthest = 0.3;  ///< m; ... to this.
  double hidden_turn = 0.8;      ///< rad

  /// Two objects of one shape change places where the colours of both together say so by this many nats (tempered), ...
  double exchange_gain = 10.0;
  double exchange_evidence = 1.0;  ///< ... and so many per visible pixel.

  bool new_objects = false;      ///< Look for more objects of the scene's models than it names.
  int new_every = 15;            ///< frames
  double new_log_ratio = 250.0;  ///< nats; smaller finds are remnants more often than objects.
  DetectionOptions detection;
};

/// Looks for an object in the frame (`terms`: with everything else known put in); on success a share of its particles
/// is put there and holds most of the weight. `current`: the evidence of where it is thought to be.
bool recover(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
             const rendering::PoseEvidence& current, const AugmentOptions& options, const WeightOptions& weighting,
             const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
             belief::ObjectBelief& object);

/// Gives some particles of an object that is refuted where it was (`frames_refuted` > 0) to places near by that it can
/// have reached unseen: hidden, outside of supports, not through them. They weigh what becoming hidden is worth; the
/// next frame decides. Returns how many were put there. Held particles stay in the hand.
int propose_hidden(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                   const Vector3d& gravity_W, const AugmentOptions& options, const WeightOptions& weighting,
                   const InitialiseOptions& spread, const FilterTools& tools, const core::RandomStream& stream,
                   belief::ObjectBelief& object);

/// Whether `second` where the first object is thought to be and `first` where the second is explain the frame so much
/// better than the other way round that they were taken for each other. Both are of one shape (target.mesh) and know
/// colours; `terms[i]` is the frame with everything put in but the i-th of them.
bool are_exchanged(const std::array<const rendering::FrameTerms*, 2>& terms,
                   const std::array<const SearchTarget*, 2>& targets, const std::array<Pose, 2>& X_CO,
                   const AugmentOptions& options, const FilterTools& tools);
/// Gives each the other's place, motion and state; names, models, colours, existence and physical parameters stay.
void exchange(belief::ObjectBelief& first, belief::ObjectBelief& second);

/// Whether an object is to be looked for in the frame of this number.
bool wants_recovery(const AugmentOptions& options, const belief::ObjectBelief& object, std::uint64_t frame);

/// Points in C of measured pixels that nothing known explains, row-major: those `tolerance` (m) or more in front of
/// what the frame expects there without the objects, and those where it expects nothing.
std::vector<Vector3d> unexplained_points(const FilterFrame& frame, const rendering::FrameTerms& terms,
                                         double tolerance);

/// Appends objects found in clusters that nothing explains, to the belief and to a copy of its scene; returns how many.
/// `known`: depth of everything tracked at frame.terms.camera.
int new_objects(const FilterFrame& frame, const belief::Observation& observation, const geometry::DepthImage& known,
                const AugmentOptions& options, const InitialiseOptions& spread, const FilterTools& tools,
                const core::RandomStream& stream, belief::Belief& belief);

}  // namespace prescene::filter
