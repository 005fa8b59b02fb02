// SPDX-License-Identifier: Apache-2.0
// Simulated depth frames of one object on a table, with the true pose: what the calibration of the likelihood is
// measured on.
#pragma once

#include <string>
#include <vector>

#include "prescene/core/random.h"
#include "prescene/core/status.h"
#include "prescene/rendering/renderer.h"
#include "prescene/rendering/sensor/likelihood_batch.h"
#include "prescene/rendering/sensor/simulated_camera.h"

namespace prescene::service {

/// A thing of everyday size, its frame in the middle of its bounding sphere.
struct TabletopObject {
  std::string name;
  rendering::MeshHandle mesh;
};

/// Carton, boxes, can, bottle, cup, bin, ball: angular and round, 3 to 23 cm.
std::vector<TabletopObject> tabletop_objects();

struct TabletopFrame {
  geometry::PinholeCamera camera;
  geometry::DepthImage depth;
  rendering::SupportRegion table;
  geometry::Pose X_CO;
};

/// The object lies on the table, turned at random, `distance` (m) from the camera, which looks down by 25 to 65
/// degrees; in every other frame (`index`) a box that nobody knows of stands in front, and may hide a part.
core::Result<TabletopFrame> simulate_tabletop(const TabletopObject& object, double distance, std::uint64_t index,
                                              const rendering::SimulatedCamera& simulated,
                                              rendering::Renderer& renderer, const core::RandomStream& stream);

}  // namespace prescene::service
