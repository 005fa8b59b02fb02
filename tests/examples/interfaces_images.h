// SPDX-License-Identifier: Apache-2.0
// What the examples in the headers of interfaces/images take for granted.
#pragma once

#include <filesystem>

#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/lens.h"

namespace prescene::interfaces::given_interfaces_images {

extern const std::filesystem::path path;

namespace lens_warp_h {
extern const geometry::PinholeCamera camera;
extern const geometry::LensDistortion lens;
extern const geometry::DepthImage raw_depth;
}  // namespace lens_warp_h

}  // namespace prescene::interfaces::given_interfaces_images
