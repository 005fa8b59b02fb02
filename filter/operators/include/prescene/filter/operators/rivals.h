// SPDX-License-Identifier: Apache-2.0
// Operator 3, augment: rival poses. What a frame can hardly distinguish from the believed pose, but is turned against
// it (a mug whose handle is behind it, a block with edges of about one length), is held beside it as further
// particles, and the frames share the weight out.
//
//   propose_rivals(frame, terms, target, symmetry, RivalPrior::kFound, weighting, spread, tools, object);
//   share_among_turns(log_weights_before, symmetry, object.particles);  // after each frame has weighed them
#pragma once

#include <span>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/resample.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/geometry/symmetry.h"

namespace prescene::filter {

/// Poses are told apart by turns from this on: what an estimate's confidence counts as another turn.
inline constexpr double kRivalTurn = 0.2618;  // rad, 15 degrees

/// nats; prior log odds of what was followed, and began with a turn that was known, to be turned otherwise.
inline constexpr double kSlipLogOdds = -5.0;
/// nats; rivals of a find that are less likely are not kept.
inline constexpr double kFoundLogOdds = -3.0;

/// Weight of the newest frame in what frames say of turns: twenty frames count.
inline constexpr double kTurnMemory = 0.05;

/// A pose that rivals another one.
struct Rival {
  Pose X_WO;
  geometry::Matrix6d covariance;  ///< Of what one frame says about it, as geometry::box_plus.
  double log_odds = 0.0;          ///< nats; tempered evidence of one frame, less that of the pose that it rivals.
};

/// Poses that are turned by kRivalTurn or more, up to symmetry, against the first of `X_WO` and each other and are what
/// a frame supports by `least_log_odds` or more, best first, at most eight. Tried are turns by multiples of 15 degrees
/// about the vertical and about the principal axes of the mesh's surface, and those of a cube along these axes, through
/// its middle and as far in front as before. The best are refined in the frame, as all of `X_WO` are, of which the best
/// that is turned like the first is what they are compared with. None is taken that reaches into a support. `terms`:
/// the frame with everything else known put in.
std::vector<Rival> find_rivals(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                               const geometry::SymmetryGroup& symmetry, std::span<const Pose> X_WO,
                               double least_log_odds, const WeightOptions& weighting, const InitialiseOptions& spread,
                               const FilterTools& tools);

/// What is known of an object's turn before the frame.
enum class RivalPrior {
  kFound,   ///< It was found in this frame, or its turn was never known: every turn is as likely as another.
  kTracked  ///< It was followed up to here: that it is turned otherwise is improbable (e^-5).
};

/// Puts the rivals of the heaviest particle into the object's set, in place of the lightest particles. Of an object
/// that was followed, only those are taken for which the frame speaks by 2.5 nats or more; they begin 3.5 nats or more
/// behind, and the next frames decide. Returns how many.
int propose_rivals(const FilterFrame& frame, const rendering::FrameTerms& terms, const SearchTarget& target,
                   const geometry::SymmetryGroup& symmetry, RivalPrior prior, const WeightOptions& weighting,
                   const InitialiseOptions& spread, const FilterTools& tools, belief::ObjectBelief& object);

/// After a frame has weighed the particles: what makes one turn look better than another (mixed pixels at an edge, a
/// coarse image, a mesh that is not quite right) mostly stays from frame to frame, so that many frames say no
/// more of two turns than an average one. Their log odds go to the mean of what single frames say, with a memory of 20
/// frames, and turns that no frame tells apart keep sharing the weight. A turn that is 3 nats or more behind the
/// likeliest was decided against: to its log odds comes `turned_log_odds`, the prior that the object is turned
/// otherwise than it was (turned_log_odds() in initialise.h). Of what the scene did not know the turn, frames alone
/// decide. Where `cameras` see the object, what single frames say is summed over them: their errors are not the same.
/// `log_weights_before`: those of the same particles before the frame. Weights within one turn are left as they are to
/// each other, and nothing is changed where there is but one.
void share_among_turns(std::span<const double> log_weights_before, const geometry::SymmetryGroup& symmetry,
                       std::vector<belief::Particle>& particles, int cameras = 1, double turned_log_odds = kSlipLogOdds,
                       double memory = kTurnMemory);

/// Whether particles of another turn than the heaviest one's have more than e^-5 of the weight.
bool holds_turns(const std::vector<belief::Particle>& particles, const geometry::SymmetryGroup& symmetry);

/// For each particle the number of its turn, the heaviest particle's first.
std::vector<std::size_t> turn_numbers(const std::vector<belief::Particle>& particles,
                                      const geometry::SymmetryGroup& symmetry);

/// As resample(), but each turn keeps its weight, and at least one particle if it has more than e^-5 of all: turns that
/// no frame tells apart would else die out by chance. Where there is but one turn it is resample().
bool resample_within_turns(const ResampleOptions& options, const core::RandomStream& stream,
                           const geometry::SymmetryGroup& symmetry, std::vector<belief::Particle>& particles);

}  // namespace prescene::filter
