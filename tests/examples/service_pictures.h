// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of service/pictures take for granted.
#pragma once

#include "prescene/belief/prediction.h"

namespace prescene::service::given_service_pictures {

namespace ground_density_h {
extern const belief::FinalPoses poses;
extern const Eigen::Vector2d low, high;
extern const double x, y;
}  // namespace ground_density_h

}  // namespace prescene::service::given_service_pictures
