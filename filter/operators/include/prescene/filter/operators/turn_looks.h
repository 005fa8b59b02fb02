// SPDX-License-Identifier: Apache-2.0
// Operator 3, augment: which way an object is turned, looked at in the camera's finer image (fine_frame.h). The coarse
// image of the likelihood hardly shows a handle: what it says of two turns differs less than it is wrong. Where the
// camera is sharp, turns are therefore weighed in the finer one, in the first frame and every few frames after it, and
// keep their odds between.
//
//   const FineFrame fine = fine_frame_if_sharp(frame, *scene, observation, tools);
//   const TurnPrior prior(scene->objects[0], symmetry);
//   const TurnLook look{frame, terms, target, fine.terms, fine_target, prior, 0.25};
//   if (fine.smear.is_sharp()) look_at_turns(look, symmetry, weighting, spread, tools, object);
#pragma once

#include <optional>

#include "prescene/belief/belief.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {

/// What the scene says of how an object is turned.
class TurnPrior {
 public:
  TurnPrior(const belief::SceneObject& object, const geometry::SymmetryGroup& symmetry);

  /// Log of how probable it is that it is turned so, against how it is most probably turned, in nats; 0 of all turns
  /// where has_wide_prior(). At least kSlipLogOdds: it may have been turned since.
  double log(const Pose& X_WO) const;

 private:
  geometry::SymmetryGroup symmetry_;
  Pose mean_;
  std::optional<geometry::Matrix3d> information_;  // rad^-2; none = open
};

struct TurnLook {
  const FilterFrame& frame;
  /// With everything else that is known put in.
  const rendering::FrameTerms& terms;
  const SearchTarget& target;
  /// The same of the fine image, which the finer mesh is drawn in (MeshDetail::kFine).
  const rendering::FrameTerms& fine_terms;
  const SearchTarget& fine_target;
  const TurnPrior& prior;
  /// Weight of this look against those before it, above 0; 1 = the first.
  double gain = 1.0;
  /// That see the object: their errors are not the same, so what single frames say is summed over them.
  int cameras = 1;
};

/// Weighs the turns that the object's particles hold, and others, in the fine image. Those that find_rivals() tries are
/// fitted to the coarse image; the best go on to the fine one, in which they are fitted and then climb by evidence,
/// as single pixels of the outline would decide otherwise. Log odds l of a turn against the likeliest become
/// (1 - gain) l + gain (p + f): f of this frame, tempered, and p of the prior, or kSlipLogOdds of turns that are no
/// likelier by the scene than one that was followed and is turned otherwise than the scene says. A turn that was not
/// held had kFoundLogOdds, and is held from kFoundLogOdds on, in place of the lightest particles. Particles go to where
/// the image fits best within their turn, where that is clearly better: by 1 nat, and by 1 - gain of what their
/// covariance, from the frames before, says against it (15 nats at most). Returns how many turns are as likely.
int look_at_turns(const TurnLook& look, const geometry::SymmetryGroup& symmetry, const WeightOptions& weighting,
                  const InitialiseOptions& spread, const FilterTools& tools, belief::ObjectBelief& object);

}  // namespace prescene::filter
