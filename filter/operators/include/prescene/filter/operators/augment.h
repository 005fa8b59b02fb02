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
  /// frames. An object that the frames have not supported for this many frames is looked for. Range 1 to 100. Chosen.
  int recover_after_frames = 4;
  /// frames. While it is not found, the search is repeated after this many frames. Range 1 to 100. Chosen.
  int recover_every = 3;
  /// share. If less than this share of a tracked object's pixels supports it, its pose may be wrong, and the object is
  /// looked for, too. Range 0 to 1. Chosen.
  double suspicious_share = 0.75;
  /// share. The same if its evidence is less than this share of what its pose would say if it were right. Range 0 to 1.
  /// Measured: docs/studies/tracking.md.
  double short_share = 0.8;
  /// frames. The search for such an object is repeated after this many frames. Range 1 to 100. Chosen.
  int suspicious_every = 10;
  /// count. A search starts from this many poses. Range 8 to 1000. Chosen.
  int recover_starts = 48;
  /// nats per pixel. A find is accepted only if the frame says at least this much for each visible pixel, with the
  /// outline taken into account. Range 0 to 10. Measured: docs/studies/tracking.md.
  double accept_evidence = 3.0;
  /// nats. A find is accepted only if its log ratio (untempered, of the frame as it is usually sampled) is at least
  /// this. Range 0 to 1000. Chosen.
  double accept_log_ratio = 40.0;
  /// nats. A find is accepted only if its log ratio (the same) exceeds that of the believed pose by at least this.
  /// Range 0 to 1000. Chosen.
  double min_gain = 10.0;
  /// m/s. A place is out of reach if the object would have had to move there faster than this since it was last seen,
  /// and is more than 10 cm away. Range 0 to 10. Chosen.
  double reach_speed = 0.7;
  /// nats per pixel. A find that is out of reach needs this much more evidence. Range 0 to 10. Chosen.
  double far_evidence = 1.0;
  /// share. When the evidence speaks against an object, this share of its particles is moved to hidden, free places
  /// near its last one and below it. Range 0 to 1. Chosen.
  double hidden_share = 0.25;
  /// nats. Two objects of one shape change places if the colours of both together favour the exchange by this log ratio
  /// (tempered). Range 0 to 1000. Chosen.
  double exchange_gain = 10.0;
  /// nats per pixel. The exchange must also be favoured by this much for each visible pixel. Range 0 to 10. Chosen.
  double exchange_evidence = 1.0;
  /// switch. Objects beyond those that the scene names are looked for: more of its models, and things that no model
  /// describes. A scene file's `new_objects` and --new-objects set it. Range true or false. Chosen.
  bool new_objects = false;
  /// frames. New objects are looked for once in this many frames. Range 1 to 1000. Chosen.
  int new_every = 15;
  /// nats. A new object is accepted only if its log ratio is at least this (in the fine image of a sharp camera 30
  /// less); smaller finds are more often remnants than objects. With --proposals, the learned judge decides instead.
  /// Range 0 to 10000. Measured: docs/studies/tracking.md.
  double new_log_ratio = 250.0;
  /// nats. The same limit for things that no model describes, which get a shape fitted around their points. Range 0 to
  /// 10000. Chosen.
  double unknown_log_ratio = 100.0;
  /// m. A cluster that is larger than this in any direction is not taken for such a thing. Range 0.05 to 5. Chosen.
  double unknown_largest = 0.4;
  /// m. A cluster that rises less than this above its support is not taken for such a thing. Range 0.005 to 0.5.
  /// Chosen.
  double unknown_lowest = 0.015;
  /// Used to look for new objects.
  DetectionOptions detection;
};

/// Looks for an object in the frame (`terms`: with everything else known put in); on success a share of its particles
/// is put there and holds most of the weight. `current`: the evidence of where it is thought to be. Nothing is taken
/// for a find that is inside of a support or, deeper than the object is believed to be, of a body of the robot; nor one
/// out of reach while the object is seen well enough where it is thought to be.
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

/// Whether an object is to be looked for in the frame of this number. `expected_evidence`: nats per pixel that its pose
/// would say if it were right (WeightReport).
bool wants_recovery(const AugmentOptions& options, const belief::ObjectBelief& object, double expected_evidence,
                    std::uint64_t frame);

/// Points in C of measured pixels that nothing known explains, row-major: those `tolerance` (m) or more in front of
/// what the frame expects there without the objects, and those where it expects nothing.
std::vector<Vector3d> unexplained_points(const FilterFrame& frame, const rendering::FrameTerms& terms,
                                         double tolerance);

/// Appends an object that was found at X_WO to a belief and to the scene that is to become its own.
void append_object(const std::string& name, int model, const Pose& X_WO, const rendering::PoseEvidence& evidence,
                   core::TimeNs stamp_ns, const InitialiseOptions& spread, const core::RandomStream& stream,
                   belief::Scene& scene, belief::Belief& belief);

/// Appends objects found in clusters that nothing explains, to the belief and to a copy of its scene; returns how many.
/// `known`: depth of everything tracked at frame.terms.camera.
int new_objects(const FilterFrame& frame, const belief::Observation& observation, const geometry::DepthImage& known,
                const AugmentOptions& options, const InitialiseOptions& spread, const FilterTools& tools,
                const core::RandomStream& stream, belief::Belief& belief);

}  // namespace prescene::filter
