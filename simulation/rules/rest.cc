// SPDX-License-Identifier: Apache-2.0
#include "prescene/simulation/rules/rest.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace prescene::simulation {
namespace {

using geometry::Vector2d;
using geometry::Vector3d;

// A toppling body has turned this many nudges when the test ends, and its centre of mass is lower by at least this
// share of what turning about a tip below it takes away. A body that rolls or rocks back is not lower.
constexpr double kRunAway = 3.0;
constexpr double kLeastDrop = 0.25;
// Time constants of an upright rod on its tip: it turns 6 times as far, a fat body still more than kRunAway times.
constexpr double kTimeConstants = 2.5;
constexpr double kShortestWindow = 0.1;  // s
constexpr double kLongestWindow = 1.0;
// m: whatever sinks by this much did not rest.
constexpr double kSunk = 2e-3;
// A footprint is a polygon when it is this wide (m) about the centre of mass at least.
constexpr double kLeastMargin = 5e-4;

}  // namespace

bool stands_firmly(std::span<Vector2d> contacts, double height, std::span<Vector2d> corners) {
  const std::size_t count = geometry::convex_polygon(contacts, corners);
  return geometry::distance_inside(corners.first(count), Vector2d::Zero()) >
         std::max(kLeastMargin, height * std::tan(kNudge));
}

Vector3d nudge_axis(const Vector3d& down, int k) {
  const Vector3d u = down.unitOrthogonal();
  const Vector3d v = down.cross(u);
  const double angle = (0.125 + 0.25 * k) * 2.0 * std::numbers::pi;
  return std::cos(angle) * u + std::sin(angle) * v;
}

double nudge_window(double height, double gravity) {
  const double time_constant = std::sqrt(4.0 / 3.0 * height / gravity);
  return std::clamp(kTimeConstants * time_constant, kShortestWindow, kLongestWindow);
}

bool topples(double drop, double height, const Vector3d& turn, const Vector3d& down) {
  if (drop > kSunk) return true;
  // Turning about the vertical is no toppling.
  const double toppled = (turn - down * down.dot(turn)).norm();
  return toppled > kRunAway * kNudge && drop > kLeastDrop * 0.5 * height * toppled * toppled;
}

bool may_topple(double drop, double height) {
  return drop > kSunk || drop > kLeastDrop * 0.5 * height * kRunAway * kRunAway * kNudge * kNudge;
}

}  // namespace prescene::simulation
