// SPDX-License-Identifier: Apache-2.0
// What the robot saw and did at one instant: Z and U of the estimation problem.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/action.h"
#include "prescene/core/clock.h"
#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"

namespace prescene::belief {

/// A registered colour and depth image (same size, same camera). Images are shared and never changed.
struct RgbdFrame {
  std::shared_ptr<const geometry::DepthImage> depth;  ///< m, 0 = no measurement
  std::shared_ptr<const geometry::ColorImage> color;  ///< Null when there is none.
  geometry::PinholeCamera camera;
};
/// Images compare by content.
bool operator==(const RgbdFrame& a, const RgbdFrame& b);

/// Z: a frame, where its camera was, and where the robot's bodies were.
struct Observation {
  core::TimeNs stamp_ns = 0;
  int camera = 0;  ///< Which of the scene's cameras it is of (camera_at()).
  RgbdFrame frame;
  Pose X_WC;
  /// Poses X_WG of kinematic bodies by the name of Scene::robot; a body that is not named is where it was last.
  std::map<std::string, Pose> robot;

  friend bool operator==(const Observation&, const Observation&) = default;
};

/// U: what was commanded since the last observation; times of the actions are relative to `begin_ns`.
struct Control {
  core::TimeNs begin_ns = 0;
  core::TimeNs end_ns = 0;
  std::vector<Action> actions;

  friend bool operator==(const Control&, const Control&) = default;
};

}  // namespace prescene::belief
