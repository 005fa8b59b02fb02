// SPDX-License-Identifier: Apache-2.0
// What hides what in worlds: a frame for each member of an island and each way in which the others stand in its worlds.
//
// A pixel that two members cover counts for the nearer one alone, against what there would be without any of them: the
// sum over members is then the log likelihood of the picture of all of them.
//
//   const WorldTerms views = world_terms(frame, {target, &object.particles}, others, depths_of_all_else, tools);
//   weight(frame.terms, target, X_WC, dt, options, tools, stream, particles, {.terms_of = views.terms_of});
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "prescene/filter/proposals/frame.h"

namespace prescene::filter {

/// A member and its particles, one a world.
struct WorldMember {
  SearchTarget target;
  const std::vector<belief::Particle>* particles = nullptr;
};

struct WorldTerms {
  std::vector<std::unique_ptr<const rendering::FrameTerms>> views;
  std::vector<const rendering::FrameTerms*> terms_of;  ///< By world, one of the views; empty = the others hide nothing.
  double pixels = 0.0;                                 ///< As WeightContext::weight_pixels.
};

/// `outside`: depth of what is in no world. Worlds share a view in which the others stand about alike (8 mm, 0.12 rad),
/// and those beyond a dozen views share the last. Members that are apart in the picture hide nothing of each other;
/// where all are, there is no view.
WorldTerms world_terms(const FilterFrame& frame, const WorldMember& member, const std::vector<WorldMember>& others,
                       std::span<const geometry::DepthImage* const> outside, const FilterTools& tools);

}  // namespace prescene::filter
