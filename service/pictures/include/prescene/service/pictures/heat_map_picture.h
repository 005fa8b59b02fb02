// SPDX-License-Identifier: Apache-2.0
// A picture of where an object may end: its final density over the scene from above and in perspective, with the
// likeliest way of ending of each outcome drawn in.
#pragma once

#include <filesystem>
#include <string>

#include "prescene/belief/query.h"
#include "prescene/belief/scene.h"
#include "prescene/geometry/image.h"
#include "prescene/service/backends.h"

namespace prescene::service {

/// `answer` was made from `scene` and has final poses, and typical runs for outlines and ways (paths for the fan of
/// ways). One part for each object that has final poses, at most three, one below the other. Fails with kNotFound if
/// none has.
core::Result<geometry::ColorImage> heat_map_picture(const belief::Scene& scene, const belief::PredictAnswer& answer,
                                                    Backends& backends);
/// The same as a PNG file.
core::Status write_heat_map(const std::filesystem::path& path, const belief::Scene& scene,
                            const belief::PredictAnswer& answer, Backends& backends);

}  // namespace prescene::service
