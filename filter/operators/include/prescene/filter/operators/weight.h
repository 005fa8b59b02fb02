// SPDX-License-Identifier: Apache-2.0
// Operator 4, weight: each particle moves to its own refined mode, its Gaussian is updated there, and its weight grows
// by the Laplace evidence of the frame. A particle whose pose is hidden may stay hidden instead of moving onto what
// hides it.
//
//   WeightReport report = weight(terms, target, X_WC, dt, options, tools, stream, object.particles);
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/filter/proposals/resting_starts.h"
#include "prescene/filter/proposals/support_surfaces.h"

namespace prescene::filter {

struct WeightOptions {
  /// count. A particle takes at most this many Gauss-Newton steps. Range 1 to 20. Chosen.
  int steps = 5;
  /// share. Random starts are drawn with this share of the predicted standard deviation. Range 0 to 1. Chosen.
  double start_spread = 0.8;
  /// share. A pose is hidden if less than this share of the pixels that it should show is not behind something else;
  /// then staying hidden competes with moving to where something is seen. Range 0 to 1. Chosen.
  double hidden_share = 0.35;
  /// nats. The log prior odds of becoming hidden, and of coming into sight again. Range -20 to 0. Chosen.
  double log_hidden = -4.0;
  /// m. Poses that reach further than this into a support are improbable; contacts are not known better. Range 0 to
  /// 0.1. Chosen.
  double support_tolerance = 0.015;
  /// m/s. A mode is refused if the object would have had to move there faster than this, beyond its predicted spread.
  /// Range 0.1 to 20. Chosen.
  double max_jump_speed = 2.0;
  /// m. If the measured surface goes on past the outline with a step smaller than this, there is no edge. Range 0.001
  /// to 0.1. Chosen.
  double outline_step = 0.02;
  /// share. A match is no evidence if less than this share of the outline has an edge. Range 0 to 1. Chosen.
  double min_outline = 0.50;
  /// share. A match is full evidence if at least this share of the outline has an edge; between the two it counts in
  /// part. Range 0 to 1. Chosen.
  double full_outline = 0.80;
};

/// What became of one particle.
struct ParticleWeight {
  rendering::PoseEvidence evidence;  ///< At its new mean.
  double outline = 1.0;              ///< Share of its outline with an edge, see outline_support in proposals/frame.h.
  bool hidden = false;
};

/// Radii of an object; so far around it its support's height is measured.
inline constexpr double kSupportAround = 2.5;
/// Share of an object that may be inside of something solid, as poses have errors, too: of what is found or turned, no
/// more may be; of a particle, more counts as all.
inline constexpr double kMostInSupport = 0.25;
/// m; how deep the middle of a seen thing may be in a support: poses and supports are not known better, and the middle
/// of what is thin is no higher above it than that.
inline constexpr double kSunkAllowed = 0.005;
/// A seen pose as it is compared with the supports: against where the frame shows them (WeightContext::support_offset),
/// and lifted by what is allowed.
Pose clear_of_support(const Pose& X_WO, double support_offset, const Vector3d& up_W);

/// What is known of the object besides the frame.
struct WeightContext {
  const SupportSurfaces* supports = nullptr;  ///< Where no pose can be; null = anywhere.
  const SupportSurfaces* solids = nullptr;    ///< The same of what no hand holds; null = no more.
  const RestingShape* shape = nullptr;        ///< How it may stand on `supports`; null = in any way.
  Vector3d up_W = Vector3d::UnitZ();          ///< Against gravity.
  /// Depth of the supports alone, of the size of the frame's terms: how far off the frame shows them; null = not at
  /// all.
  const geometry::DepthImage* support_depth = nullptr;
  /// m; so far above where the scene has them, the frame shows the supports about the object (support_height()).
  double support_offset = 0.0;
  bool was_unseen = false;  ///< In the frame before.
  /// The full depth image and its camera, for where the object ends in it; null = poses follow depth residuals alone.
  const geometry::DepthImage* depth = nullptr;
  geometry::PinholeCamera camera = {};
  /// The colour image of the same camera and size, for the same; null = depth alone says it.
  const geometry::ColorImage* color = nullptr;
  /// By particle, the frame with what hides it in its world put in; empty = the same for all.
  std::span<const rendering::FrameTerms* const> terms_of = {};
  /// Number of pixels that weights are tempered by, for all members of worlds alike; 0 = the object's own.
  double weight_pixels = 0.0;
};

struct WeightReport {
  std::vector<ParticleWeight> particles;
  int heaviest = 0;
  double hidden_weight = 0.0;   ///< Of the particles that stayed hidden.
  bool all_impossible = false;  ///< No particle had a finite weight: the weights were made equal.
  /// Nats per visible pixel of the heaviest particle, worth less where the outline has no edge.
  double evidence_per_pixel = 0.0;
  /// What the heaviest particle's pose would say on average were it right, in the same unit.
  double expected_evidence = std::numeric_limits<double>::infinity();
  double evidence_deviation = 0.0;  ///< Standard deviation of that from frame to frame.
  double visible_share = 0.0;       ///< Of the pixels that it covers in view.
  int visible_pixels = 0;
};

/// `terms`: the frame with what else is known put in (terms_for_object); `dt` since the last frame, s. Particles'
/// means, covariances and weights (normalised) change. Source: Rao-Blackwellised particle filter [Doucet et al. 2000]
/// with Laplace's approximation about each particle's mode.
WeightReport weight(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_WC, double dt,
                    const WeightOptions& options, const FilterTools& tools, const core::RandomStream& stream,
                    std::vector<belief::Particle>& particles, const WeightContext& context = {});

/// Says of the heaviest particle, as it stands once its weight in worlds is known, what the report says of it, with the
/// evidence that `terms` hold for it.
void evidence_of_heaviest(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_WC,
                          const WeightOptions& options, const FilterTools& tools,
                          const std::vector<belief::Particle>& particles, WeightReport& report);

/// How many pixels of a pose are measured, and at least a few: what its weights are tempered by.
double tempering_pixels(const rendering::FrameTerms& terms, const SearchTarget& target, const Pose& X_CO,
                        const FilterTools& tools);

/// Evidence per visible pixel, scaled by what the outline is worth.
double supported_evidence(const rendering::PoseEvidence& evidence, double outline, const WeightOptions& options);

/// The likelihood's information about a pose in W (box_plus coordinates) from that in C.
geometry::Matrix6d information_in_world(const geometry::Matrix6d& H_C, const geometry::Quaterniond& R_CW);

}  // namespace prescene::filter
