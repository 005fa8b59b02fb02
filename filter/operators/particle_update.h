// SPDX-License-Identifier: Apache-2.0
// The parts that weight() is made of: a particle's Gaussian, its mode near the prediction, and what a frame says about
// poses of one object.
#pragma once

#include <optional>

#include "prescene/filter/operators/standing.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/proposals/outline.h"

namespace prescene::filter {

// Share of the variance of what a frame says of a pose: errors that stay from frame to frame (calibration, a pattern in
// the depth), which do not average out over what lies still.
inline constexpr double kCommonError = 0.5;
inline constexpr double kLastGate = 0.012;       // m; residuals beyond about half of it lose their weight at the end
inline constexpr double kMostStartShift = 0.03;  // m; a start is never further off, however wide the prediction is, ...
inline constexpr double kMostStartTurn = 0.35;   // rad; ... nor turned further

struct Gaussian {
  Matrix6d covariance;
  Matrix6d information;
  Matrix6d root;  ///< Lower Cholesky factor of the covariance.
  double log_determinant = 0.0;
};
Gaussian gaussian(const Matrix6d& covariance);

/// A mode near the prediction, with the covariance about it.
struct Mode {
  Pose X_WO;
  Vector6d shift = Vector6d::Zero();  ///< From the prediction, box_plus coordinates.
  Matrix6d covariance;
  double log_determinant = 0.0;
};

/// What the frame says about a pose, in W.
struct FrameEquations {
  Matrix6d information;
  Vector6d gradient;
  rendering::PoseEvidence evidence;
};

/// Of such a thing, the measured surface is mostly the one behind, which goes on.
bool is_see_through(const SearchTarget& target);
bool is_near(const Vector6d& d, double shift, double turn);
/// Of residuals at a share t of the steps.
double gate_at(double t);
/// The factor that brings a length down to its limit.
double limited(double length, double limit);
/// outline_support() at a pose of what is tracked, beside which missing pixels may be where its surface ends.
double outline_at(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CO,
                  const WeightOptions& options, const FilterTools& tools);
/// Evidence in favour of the pose counts as much as its outline is worth; evidence against it counts in full.
double worth(double log_ratio, double outline, const WeightOptions& options);
/// The share of the pixels that the pose should show that show it or something further away.
double shown_share(const rendering::PoseEvidence& evidence);
/// Moves the particle's Gaussian to the mode: the pose block becomes the mode's, the rest follows by the gain.
void move_to(const Mode& mode, const Gaussian& predicted, belief::Particle& particle);
/// How far the mode may be from the prediction: what the motion allows in the time, and its spread.
bool within_reach(const Mode& mode, const Gaussian& predicted, double dt, const WeightOptions& options);

/// What a frame says of one hypothesis, with a workspace of the pool.
rendering::PoseEvidence evidence_of(const rendering::FrameTerms& terms, const rendering::PoseHypothesis& hypothesis,
                                    const FilterTools& tools);

/// The outline at a pose, with its colours where the context has a colour image. The context has a depth image.
Outline outline_of(const SearchTarget& target, const Pose& X_CO, const rendering::FrameTerms& terms,
                   const WeightContext& context, const FilterTools& tools);

/// An outline and the pose that it was taken at.
struct TakenOutline {
  Pose X_WO;
  Outline outline;
};

class ParticleUpdate {
 public:
  ParticleUpdate(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CW, double pixels,
                 const WeightOptions& options, const FilterTools& tools, const WeightContext& context,
                 const TakenOutline* shared_outline, rendering::LikelihoodWorkspace& workspace);

  /// Climbs from box_plus(predicted, start) on the tempered likelihood times the prediction.
  Mode climb(const Pose& X_WO_predicted, const Gaussian& predicted, const Vector6d& start) const;
  /// Depth residuals up to the gate, tempered, and the outline if there is one.
  FrameEquations equations_at(const Pose& X_WO, double gate, const Outline* outline, bool with_evidence = false) const;
  /// Takes out of `equations` what the likelihood does not confirm of turns that stay uncertain: where it falls by less
  /// than half of what the equations have it, and by little, to either side, they know the turn no better than it does
  /// (a handle that is hidden, facets, noise along an outline). `covariance`: of the pose, which says what turns are
  /// uncertain and what follows them; of a climb given the prediction and the equations, of what lies still before the
  /// frame. Returns whether anything was taken.
  bool keep_confirmed(const Pose& X_WO, const Matrix6d& covariance, FrameEquations& equations) const;
  /// What follows from resting at this pose, where the frame says that of it (standing.h); zero where nothing does.
  PoseEquations standing_at(const Pose& X_WO, const FrameEquations& seen) const;
  /// The shared outline where it serves, else one taken here; null where poses follow residuals alone.
  const Outline* outline_near(const Pose& X_WO, std::optional<Outline>& own) const;
  rendering::PoseEvidence evidence(const Pose& X_WO) const;
  double outline(const Pose& X_WO) const;
  /// What it costs to be where a support is, or a body of the robot. What is held was seen in the hand, whatever the
  /// hand's shape says.
  double log_overlap(const belief::Particle& particle) const;
  /// What it costs a pose that is seen to be where a support is: the supports themselves look like the top of what is
  /// in them. They are taken to be where the frame shows them.
  double log_in_support(const Pose& X_WO) const;

  bool was_unseen() const { return context_.was_unseen; }
  double weight_share() const { return weight_share_; }

 private:
  double log_inside(const SupportSurfaces* solids, const Pose& X_WO) const;

  const rendering::FrameTerms& terms_;
  const SearchTarget& target_;
  Pose X_CW_;
  double pixels_;
  const WeightOptions& options_;
  const FilterTools& tools_;
  const WeightContext& context_;
  const TakenOutline* shared_outline_;
  rendering::LikelihoodWorkspace& workspace_;
  double information_share_;
  double weight_share_;
};

}  // namespace prescene::filter
