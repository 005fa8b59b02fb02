// SPDX-License-Identifier: Apache-2.0
#include "rest_detector.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace prescene::simulation {
namespace {

// rad. A body that a quarter of a degree topples is not at rest: tables shake more.
constexpr double kNudge = 0.0044;
// A balanced body of 10 cm turns 10 times as far in 0.25 s; a stable one rocks back within its nudge.
constexpr double kNudgeTime = 0.25;
constexpr double kRunAway = 3.0;
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

bool RestDetector::at_rest(InstanceWorld& world) {
  const int needed = static_cast<int>(std::ceil(world.scene().options.rest.time / world.dt()));
  for (int i = 0; i < world.object_count(); ++i) {
    if (world.free(i) && world.calm_steps(i) < needed) {
      tested_ = false;
      return false;
    }
  }
  if (!world.actions_finished()) return false;
  if (!tested_) {
    tested_ = true;
    stable_ = true;
    for (int i = 0; i < world.object_count() && stable_; ++i) {
      if (world.free(i)) stable_ = stands_firmly(world, i) || returns_after_nudges(world, i);
    }
  }
  return stable_;
}

bool RestDetector::stands_firmly(const InstanceWorld& world, int object) {
  bool others = false;
  world.footprint(object, footprint_, others);
  if (others) return false;
  const Vector3d& gravity = world.scene().scene.gravity_W;
  if (gravity.isZero(0.0)) return true;
  const Vector3d down = gravity.normalized();
  const Vector3d u = down.unitOrthogonal();
  const Vector3d v = down.cross(u);
  const Vector3d center = world.center_of_mass(object);
  double height = 0.0;
  std::vector<Eigen::Vector2d> points;
  points.reserve(footprint_.size());
  for (const Vector3d& p : footprint_) {
    const Vector3d arm = p - center;
    height = std::max(height, down.dot(arm));
    points.emplace_back(u.dot(arm), v.dot(arm));
  }
  return margin_inside(points) > std::max(kLeastMargin, height * std::tan(kNudge));
}

bool RestDetector::returns_after_nudges(InstanceWorld& world, int object) {
  const Vector3d& gravity = world.scene().scene.gravity_W;
  if (gravity.isZero(0.0)) return true;
  const Vector3d down = gravity.normalized();
  const Vector3d u = down.unitOrthogonal();
  const Vector3d v = down.cross(u);
  world.save(saved_);
  const int steps = static_cast<int>(std::ceil(kNudgeTime / world.dt()));
  std::vector<Quaterniond> before;
  for (int i = 0; i < world.object_count(); ++i) before.push_back(world.rotation(i));
  bool returns = true;
  for (int k = 0; k < kNudgeAxes && returns; ++k) {
    // Axes between the body's likely edges, both senses of turning: 22.5, 112.5, 202.5 and 292.5 degrees.
    const double angle = (0.125 + 0.25 * k) * 2.0 * std::numbers::pi;
    world.nudge(object, std::cos(angle) * u + std::sin(angle) * v, kNudge);
    for (int s = 0; s < steps && returns; ++s) {
      world.step();
      ++nudge_steps_;
      for (int i = 0; i < world.object_count(); ++i) {
        if (!world.free(i)) continue;
        const Vector3d turn = geometry::log_rotation(world.rotation(i) * before[static_cast<std::size_t>(i)].conjugate());
        // Turning about the vertical is no toppling.
        if ((turn - down * down.dot(turn)).norm() > kRunAway * kNudge) returns = false;
      }
    }
    world.restore(saved_);
  }
  return returns;
}

}  // namespace prescene::simulation
