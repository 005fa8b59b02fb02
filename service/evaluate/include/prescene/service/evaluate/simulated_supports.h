// SPDX-License-Identifier: Apache-2.0
// Simulated depth frames of rooms with several supports at different heights: objects that stand and lie on them,
// things that nobody knows of, and the truth. What finding objects in a frame is measured on.
//
//   PRESCENE_TRY(SupportsFrame frame, simulate_supports(1001, *renderer));
//   filter.step(filter.start(frame.scene, 1), frame.observation, {});
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/observation.h"
#include "prescene/belief/scene.h"
#include "prescene/core/status.h"
#include "prescene/rendering/renderer.h"

namespace prescene::service {

/// Which of the supports the scene names.
enum class ListedSupports { kAll, kNone, kSome };

/// An object of the scene as it really is.
struct TrueObject {
  geometry::Pose X_WO;
  std::string stands_on;       ///< The support, or what else it stands on.
  double visible_share = 0.0;  ///< Of its pixels, those that nothing hides.
  int visible_pixels = 0;      ///< Of the full image.
  /// At least 40 % and 1000 pixels of it are visible and its centre is 20 pixels or more inside of the image: it is
  /// expected to be found.
  bool expected = false;
};

struct SupportsFrame {
  /// 3 to 8 objects of which the scene says that they are somewhere in the room, any way up, and the listed supports.
  std::shared_ptr<const belief::Scene> scene;
  belief::Observation observation;
  std::vector<TrueObject> truth;  ///< One an object of the scene.
  int supports = 0;               ///< 2 to 4 that things can stand on, a shelf's boards and the floor among them.
  ListedSupports listed = ListedSupports::kAll;
  bool has_floor = false;
};

/// A scene of all models that the rooms' objects are of, and nothing else: what proposals for them are learned of.
core::Result<belief::Scene> room_models();

/// The frame of this number: room, objects, camera and noise are drawn from it alone. The noise is that of the
/// simulated camera with figures that are not the filter's. Listed are all supports, none, or some, in turn.
core::Result<SupportsFrame> simulate_supports(std::uint64_t number, rendering::Renderer& renderer);

}  // namespace prescene::service
