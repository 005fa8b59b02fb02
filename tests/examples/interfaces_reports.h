// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/reports take for granted.
#pragma once

#include "prescene/belief/prediction.h"
#include "prescene/geometry/image.h"

namespace prescene::interfaces::given_interfaces_reports {

extern const belief::PredictAnswer answer;
extern geometry::ColorImage picture;

}  // namespace prescene::interfaces::given_interfaces_reports
