// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of filter take for granted.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "prescene/belief/belief.h"
#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/parallel.h"
#include "prescene/core/random.h"
#include "prescene/filter/operators/augment.h"
#include "prescene/filter/operators/initialise.h"
#include "prescene/filter/operators/learn_colors.h"
#include "prescene/filter/operators/predict.h"
#include "prescene/filter/operators/weight.h"
#include "prescene/filter/particle_filter.h"
#include "prescene/filter/proposals/detection.h"
#include "prescene/filter/proposals/frame.h"
#include "prescene/filter/proposals/segmentation.h"
#include "prescene/filter/proposals/support_tracking.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/color_model.h"

namespace prescene::filter::given_filter {

extern const std::shared_ptr<const belief::Scene> scene;
extern const std::uint64_t seed;
extern const belief::Observation observation;
extern belief::Belief belief;

namespace particle_filter_h {
extern const rendering::LikelihoodBatch& likelihood;
extern rendering::Renderer& renderer;
extern core::ThreadPool threads;
extern const FilterSettings settings;
extern const belief::Control control;
}  // namespace particle_filter_h

}  // namespace prescene::filter::given_filter
