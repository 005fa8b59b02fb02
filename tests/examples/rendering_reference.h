// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of rendering/reference take for granted.
#pragma once

#include "prescene/rendering/sensor/likelihood_batch.h"

namespace prescene::rendering::given_rendering_reference {

extern const FrameTerms terms;
extern const PoseHypothesis hypothesis;
extern const int x, y;

}  // namespace prescene::rendering::given_rendering_reference
