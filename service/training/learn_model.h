// SPDX-License-Identifier: Apache-2.0
// What is learned of one model alone, from views of it.
#pragma once

#include <vector>

#include "prescene/belief/object_model.h"
#include "prescene/core/random.h"
#include "prescene/filter/proposals/learned_proposals.h"
#include "prescene/rendering/renderer.h"

namespace prescene::service {

/// The ways in which a model lies on a level surface, likeliest first; none where it has no volume.
std::vector<filter::LearnedRest> rests_of(const belief::ObjectModel& model);
/// A way to lie, drawn by probability, turned at random about up (z of the frame that is returned in); any rotation
/// where `rests` is empty.
geometry::Quaterniond draw_rest(const std::vector<filter::LearnedRest>& rests, core::RandomStream& draws);

/// `views` pictures of the model, most of them lying on a level surface, and `places` on each of them.
core::Result<filter::LearnedModel> learn_model(const belief::ObjectModel& model, const rendering::MeshHandle& mesh,
                                               int views, int places, rendering::Renderer& renderer,
                                               core::RandomStream draws);

}  // namespace prescene::service
