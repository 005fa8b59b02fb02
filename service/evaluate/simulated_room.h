// SPDX-License-Identifier: Apache-2.0
// Rooms drawn at random: furniture at different heights, and where on it things can stand.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/random.h"
#include "prescene/geometry/pose.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::service {

/// What something covers, seen from above: a convex polygon.
using Outline = std::vector<Eigen::Vector2d>;
Outline outline_of(const geometry::TriangleMesh& mesh, const geometry::Pose& X_WM);

/// A level rectangle that things can stand on.
struct RoomPlace {
  std::string name;
  geometry::Pose X_WP;  ///< At its middle, z up.
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
  double headroom = std::numeric_limits<double>::infinity();
};

struct Furniture {
  belief::Support support;
  std::vector<RoomPlace> places;
  Outline outline;  ///< On the ground; empty for the floor, which is under everything.
};

/// The room: floor (perhaps), furniture in a row, a wall behind it (perhaps).
struct Room {
  std::vector<Furniture> furniture;
  std::optional<geometry::TriangleMesh> wall;
  bool has_floor = false;
  int supports = 0;            ///< Places that things can stand on.
  double middle_height = 0.0;  ///< Mean of these, m.
};

Room furnish(core::RandomStream& draws);

}  // namespace prescene::service
