// SPDX-License-Identifier: Apache-2.0
#include "rest_detector.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace prescene::simulation {
namespace {

// m/s. A body that stands firmly, calm for the rest rule's time, and still faster slides on a slope that friction
// hardly holds it on.
constexpr double kCreep = 1e-3;
// rad. A body that half a degree topples is not at rest: tables shake more.
constexpr double kNudge = 0.0087;
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
constexpr int kNudgeAxes = 4;
// A footprint is a polygon when it is this wide (m) about the centre of mass at least.
constexpr double kLeastMargin = 5e-4;

/// Distance of the origin to the nearest side of the convex hull of points in the plane, negative outside.
double margin_inside(std::vector<Eigen::Vector2d>& points) {
  if (points.size() < 3) return -1.0;
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  const auto cross = [](const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
  };
  std::vector<Eigen::Vector2d> hull;
  for (int half = 0; half < 2; ++half) {
    const std::size_t base = hull.size();
    for (const Eigen::Vector2d& p : points) {
      while (hull.size() >= base + 2 && cross(hull[hull.size() - 2], hull.back(), p) <= 0.0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  if (hull.size() < 3) return -1.0;
  double margin = 1e30;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d& a = hull[i];
    const Eigen::Vector2d& b = hull[(i + 1) % hull.size()];
    margin = std::min(margin, cross(a, b, Eigen::Vector2d::Zero()) / (b - a).norm());
  }
  return margin;
}

}  // namespace

bool RestDetector::at_rest(InstanceWorld& world, const core::Cancellation* cancellation) {
  const int needed = static_cast<int>(std::ceil(world.scene().options.rest.time / world.dt()));
  for (int i = 0; i < world.object_count(); ++i) {
    if (world.free(i) && world.calm_steps(i) < needed) {
      tested_ = false;
      return false;
    }
  }
  if (!world.actions_finished()) return false;
  if (!tested_) {
    for (int i = 0; i < world.object_count(); ++i)
      if (world.free(i) && world.velocity(i).norm() > kCreep && stands_firmly(world, i)) return false;
    tested_ = true;
    stable_ = true;
    for (int i = 0; i < world.object_count() && stable_; ++i) {
      if (world.free(i)) stable_ = stands_firmly(world, i) || returns_after_nudges(world, i, cancellation);
      if (cancellation && cancellation->requested()) tested_ = stable_ = false;
    }
  }
  return stable_;
}

bool RestDetector::stands_firmly(InstanceWorld& world, int object) {
  const Vector3d& gravity = world.scene().scene.gravity_W;
  if (gravity.isZero(0.0)) return true;
  const Vector3d down = gravity.normalized();
  const InstanceWorld::Footing footing = world.footing(object, down);
  if (footing.others) return false;
  const Vector3d u = down.unitOrthogonal();
  const Vector3d v = down.cross(u);
  const Vector3d center = world.center_of_mass(object);
  std::vector<Eigen::Vector2d> points;
  points.reserve(footing.points.size());
  for (const Vector3d& p : footing.points) points.emplace_back(u.dot(p - center), v.dot(p - center));
  return margin_inside(points) > std::max(kLeastMargin, footing.height * std::tan(kNudge));
}

bool RestDetector::returns_after_nudges(InstanceWorld& world, int object, const core::Cancellation* cancellation) {
  const Vector3d& gravity = world.scene().scene.gravity_W;
  if (gravity.isZero(0.0)) return true;
  const Vector3d down = gravity.normalized();
  const Vector3d u = down.unitOrthogonal();
  const Vector3d v = down.cross(u);
  before_.clear();
  double tallest = 0.0;
  for (int i = 0; i < world.object_count(); ++i) {
    if (cancellation && cancellation->requested()) return false;
    const Vector3d center = world.center_of_mass(i);
    before_.push_back({world.rotation(i), center, world.footing(i, down).height});
    if (i == object) tallest = before_.back().height;
  }
  const double time_constant = std::sqrt(4.0 / 3.0 * tallest / gravity.norm());
  const double time = std::clamp(kTimeConstants * time_constant, kShortestWindow, kLongestWindow);
  const int steps = static_cast<int>(std::ceil(time / world.dt()));

  const auto runs_away = [&](int i) {
    const Before& before = before_[static_cast<std::size_t>(i)];
    const double drop = down.dot(world.center_of_mass(i) - before.center_of_mass);
    if (drop > kSunk) return true;
    const Vector3d turn = geometry::log_rotation(world.rotation(i) * before.rotation.conjugate());
    // Turning about the vertical is no toppling.
    const double toppled = (turn - down * down.dot(turn)).norm();
    return toppled > kRunAway * kNudge && drop > kLeastDrop * 0.5 * before.height * toppled * toppled;
  };
  saved_.clear();
  ByteWriter saved(saved_);
  world.save(saved);
  bool returns = true;
  for (int k = 0; k < kNudgeAxes && returns; ++k) {
    // Axes between a body's likely edges, both senses of turning: 22.5, 112.5, 202.5 and 292.5 degrees.
    const double angle = (0.125 + 0.25 * k) * 2.0 * std::numbers::pi;
    world.nudge(object, std::cos(angle) * u + std::sin(angle) * v, kNudge);
    for (int s = 0; s < steps && returns; ++s) {
      if (cancellation && cancellation->requested()) returns = false;
      returns = world.step(cancellation) && returns;
      for (int i = 0; i < world.object_count() && returns; ++i) returns = !world.free(i) || !runs_away(i);
    }
    ByteReader before(saved_);
    world.restore(before);
  }
  return returns;
}

}  // namespace prescene::simulation
