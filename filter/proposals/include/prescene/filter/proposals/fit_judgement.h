// SPDX-License-Identifier: Apache-2.0
// The numbers by which a learned judge tells whether a candidate really is the object: how well and how much of the
// frame it explains, what speaks against it, and what else could be there.
//
//   FitNumbers numbers = fit_numbers(fit, terms, *renderer);
//   double log_odds = proposals.fit.log_odds(numbers);
#pragma once

#include <array>
#include <span>

#include "prescene/filter/proposals/learned_proposals.h"
#include "prescene/filter/proposals/pose_search.h"
#include "prescene/rendering/renderer.h"

namespace prescene::filter {

using FitNumbers = std::array<float, kFitNumbers>;

/// Places in FitNumbers. Shares are of the pixels that the object covers and no known thing hides.
enum FitNumber : std::size_t {
  kFitEvidence,          ///< ln of the log ratio, at least 1 nat.
  kFitEvidencePerPixel,  ///< Nats per visible pixel ...
  kFitEvidenceShare,     ///< ... and its share of what the sensor model expects of the pose ...
  kFitExpected,          ///< ... which is this.
  kFitHits,              ///< Share of the visible pixels that match.
  kFitVisible,           ///< Visible pixels of those in view, and ln of their number.
  kFitPixels,
  kFitOutline,          ///< outline_support.
  kFitStands,           ///< 1 on a support or a known thing, else 0.
  kFitBehind,           ///< Share measured behind its surface, where it is seen through ...
  kFitFarBehind,        ///< ... and that by more than 3 cm.
  kFitInFront,          ///< Share measured in front of it.
  kFitMissing,          ///< Share without a measurement.
  kFitMeanResidual,     ///< Of the matching pixels, in standard deviations ...
  kFitResidual,         ///< ... and its root mean square.
  kFitNormals,          ///< Mean cosine between measured and modelled normals where it matches ...
  kFitNormalSpread,     ///< ... and how much the modelled ones spread: 0 = a plane.
  kFitCluster,          ///< Share of its cluster's points that it explains.
  kFitClusterSize,      ///< ln of the number of these points.
  kFitRestAngle,        ///< Between up and the nearest way to lie, rad ...
  kFitRestProbability,  ///< ... and ln of the probability of those within 0.25 rad.
  kFitRivalModels,      ///< ln of its log ratio over the best of other models in the same cluster ...
  kFitRivalPoses,       ///< ... and over the best of its own model elsewhere.
  kFitRadius,           ///< Of the model, m.
  kFitDepth,            ///< Of its centre, m.
  kFitHidden,           ///< Share of the pixels in view that known things hide.
  kFitBorder,           ///< Share of its pixels that are at the image's border.
};

/// A candidate and what belongs to it.
struct Fit {
  const SearchTarget* target = nullptr;
  const LearnedModel* learned = nullptr;  ///< Null: how it comes to lie is not known (kFitRestAngle = pi).
  Pose X_CO;
  rendering::PoseEvidence evidence;
  std::span<const Vector3d> cluster_C;  ///< Points of the cluster that it is to explain.
  Vector3d up_C = -Vector3d::UnitY();
  bool stands = false;
  const geometry::ColorImage* color = nullptr;  ///< Of the frame, as outline_support takes it.
  double rival_models = 0.0;                    ///< Largest log ratio of other models in its cluster, nats; 0 = none.
  double rival_poses = 0.0;                     ///< The same of its own model elsewhere.
};

/// What can't be drawn counts as explaining nothing.
FitNumbers fit_numbers(const Fit& fit, const rendering::FrameTerms& terms, rendering::Renderer& renderer);
/// Probability that a pose which fits the fine image (fine_frame.h) like this is right: logistic regression on its
/// share of the expected evidence, its outline, its residuals and its rivals. In cross-validation over 260 simulated
/// rooms, more numbers gained next to nothing (docs/studies/tracking.md). Where a scene's own models were learned,
/// LearnedProposals::fit decides instead.
double probability_of_fit(const FitNumbers& numbers);
/// Probability that a find is right whose fit alone has `probability` (probability_of_fit) and of whose log ratio the
/// best other place beside it lacks a share of `margin`, > 0: where a thing is hidden, several places may fit alike.
double probability_of_find(double probability, double margin);
/// Only kFitRivalModels, kFitRivalPoses: they change when others do.
void set_rivals(const Fit& fit, FitNumbers& numbers);

}  // namespace prescene::filter
