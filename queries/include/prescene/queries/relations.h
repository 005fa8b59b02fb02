// SPDX-License-Identifier: Apache-2.0
// How things are related now, with probabilities: on, supports, in, touches, holds, upright, visible, within reach.
//
//   PRESCENE_TRY(const belief::RelationsAnswer answer, relations(*snapshot, {.object = "mug"}, context));
//   for (const belief::RelationProbability& relation : answer.relations) ... relation.probability
//
// A probability is the share of states of the world, drawn from the belief or from a scene's priors, in which the
// relation holds; objects that lie still are drawn flush with what is below them, as in all questions. In each draw
//
// - contacts are those of the simulator and its contact rules (simulation/rules): everything is stopped, hands let go,
//   and gravity acts for as long as a fall through the tolerance of an object takes. The tolerance is the contact
//   rules' touching distance and three standard deviations, over the draws, of the height of the object's lowest point,
//   at most Seating::kMostGap (3 cm). So a gap below that can't be distinguished from contact is closed, and things
//   drawn overlapping touch, as they can't be there. `on`: the mean normal of the contact, weighted by impulse, is
//   within 60 degrees of the vertical and points up (belief::supports). `supports` is the same, said of the lower
//   thing.
// - `in`: at least half of a thing's surface is in the other's hollow. A point is in the hollow when at least 5/8 of
//   all directions from it meet the other's surface (in the plane of a rim half of them do) and it is not in its solid;
//   or when it is in the box that the scene gives as the hollow. The surface is that of the collision shapes before any
//   hull is taken.
// - `holds`: the particle's mode, and the hand of the scene.
// - `upright`: the normal of the face that a thing rests on as its model was made (that of its resting faces nearest to
//   -z of its frame; z where it has none within 15 degrees) is within the angle asked for of the vertical, up to its
//   symmetry. Not judged of balls.
// - `visible`: nothing hides at least 5 % of the area that the camera would see of it; `share` is the mean of that
//   area.
// - `within_reach`: a point of its surface is that near to the point asked for.
#pragma once

#include <memory>

#include "prescene/belief/relations.h"
#include "prescene/core/status.h"
#include "prescene/queries/query_engine.h"

namespace prescene::queries {

/// Directions from a point that meet a hollow thing, as a share, for the point to be in it.
inline constexpr double kEnclosed = 0.625;
/// Share of a thing's surface in a hollow for it to be in it, and of its visible area for it to be visible.
inline constexpr double kMostlyIn = 0.5, kBarelyVisible = 0.05;

/// kNotFound for an object that is unknown or lost (with the nearest names) and where no object is there at all;
/// kInvalidInput for a query out of range or a reach from an unknown body; errors of the simulator; kCancelled.
core::Result<belief::RelationsAnswer> relations(const belief::Belief& snapshot, const belief::RelationsQuery& query,
                                                const QueryContext& context);
/// Of the start that a scene file describes.
core::Result<belief::RelationsAnswer> relations(const std::shared_ptr<const belief::Scene>& scene, std::uint64_t seed,
                                                const belief::RelationsQuery& query, const QueryContext& context);

}  // namespace prescene::queries
