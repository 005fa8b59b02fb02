// SPDX-License-Identifier: Apache-2.0
#include "lane_rest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace prescene::simulation {
namespace {

// As in simulation/bullet/rest_detector.cc, which says why.
constexpr double kCreep = 1e-3;    // m/s
constexpr double kNudge = 0.0087;  // rad
constexpr double kRunAway = 3.0;
constexpr double kLeastDrop = 0.25;
constexpr double kTimeConstants = 2.5;
constexpr double kShortest = 0.1;  // s
constexpr double kLongest = 1.0;
constexpr double kSunk = 2e-3;  // m
constexpr int kNudgeAxes = 4;
constexpr double kLeastMargin = 5e-4;  // m

struct Point {
  double x, y;
};

double cross(const Point& o, const Point& a, const Point& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

/// Distance of the origin to the nearest side of the convex hull of points in the plane, negative outside.
double margin_inside(std::span<Point> points) {
  if (points.size() < 3) return -1.0;
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  std::array<Point, 2 * kMaxContacts + 2> hull;
  std::size_t size = 0;
  for (int half = 0; half < 2; ++half) {
    const std::size_t base = size;
    for (const Point& p : points) {
      while (size >= base + 2 && cross(hull[size - 2], hull[size - 1], p) <= 0.0) --size;
      hull[size++] = p;
    }
    --size;
    std::reverse(points.begin(), points.end());
  }
  if (size < 3) return -1.0;
  double margin = 1e30;
  for (std::size_t i = 0; i < size; ++i) {
    const Point& a = hull[i];
    const Point& b = hull[(i + 1) % size];
    const double length = std::sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
    margin = std::min(margin, cross(a, b, Point{0.0, 0.0}) / length);
  }
  return margin;
}

}  // namespace

LaneFooting footing_of(LaneEngine& engine, int slot, int object) {
  LaneFooting footing;
  const Vector3d& gravity = engine.scene().scene.gravity_W;
  if (gravity.isZero(0.0)) {
    footing.firm = true;
    return footing;
  }
  const Vector3d down = gravity.normalized();
  const Vector3d u = down.unitOrthogonal();
  const Vector3d v = down.cross(u);
  std::array<Point, kMaxContacts> points;
  std::size_t count = 0;
  bool others = false;
  const Vector3d center = engine.center_of_mass(slot, object);
  // Contacts are kept with the first of two objects.
  for (int first = 0; first <= object; ++first) {
    const geometry::Matrix3d R = engine.rotation(slot, first).toRotationMatrix();
    const Vector3d from_center = engine.center_of_mass(slot, first) - center;
    for (const LaneContact& c : engine.contacts(slot, first)) {
      const int other = engine.scene().lanes.parts[static_cast<std::size_t>(c.part)].body;
      if (first != object && other != object) continue;
      if (static_cast<double>(c.gap) > engine.scene().options.touching_distance) continue;
      const Vector3d r =
          from_center + R * Vector3d(static_cast<double>(c.position[0]), static_cast<double>(c.position[1]),
                                     static_cast<double>(c.position[2]));
      footing.height = std::max(footing.height, down.dot(r));
      others = others || first != object || (other >= 0 && other < engine.objects());
      if (!others) points[count++] = {u.dot(r), v.dot(r)};
    }
  }
  footing.firm =
      !others && margin_inside({points.data(), count}) > std::max(kLeastMargin, footing.height * std::tan(kNudge));
  return footing;
}

bool NudgeTest::slides(LaneEngine& engine, int slot) const {
  for (int object = 0; object < engine.objects(); ++object)
    if (engine.free(slot, object) && engine.velocity(slot, object).norm() > kCreep &&
        footing_of(engine, slot, object).firm)
      return true;
  return false;
}

bool NudgeTest::stands_or_begins(LaneEngine& engine, int slot) {
  for (int object = 0; object < engine.objects(); ++object) {
    before_[static_cast<std::size_t>(object)] = {engine.center_of_mass(slot, object), engine.rotation(slot, object),
                                                 footing_of(engine, slot, object)};
  }
  object_ = -1;
  if (!next_object(engine, slot)) return true;
  engine.save(slot, saved_);
  down_ = engine.scene().scene.gravity_W.normalized();
  axis_ = 0;
  nudge(engine, slot);
  return false;
}

bool NudgeTest::next_object(const LaneEngine& engine, int slot) {
  for (++object_; object_ < engine.objects(); ++object_) {
    if (engine.free(slot, object_) && !before_[static_cast<std::size_t>(object_)].footing.firm) return true;
  }
  return false;
}

void NudgeTest::nudge(LaneEngine& engine, int slot) {
  const Vector3d u = down_.unitOrthogonal();
  const Vector3d v = down_.cross(u);
  const double angle = (0.125 + 0.25 * axis_) * 2.0 * std::numbers::pi;
  engine.nudge(slot, object_, std::cos(angle) * u + std::sin(angle) * v, kNudge);
  const double height = before_[static_cast<std::size_t>(object_)].footing.height;
  const double time_constant = std::sqrt(4.0 / 3.0 * height / engine.scene().scene.gravity_W.norm());
  const double time = std::clamp(kTimeConstants * time_constant, kShortest, kLongest);
  left_ = static_cast<int>(std::ceil(time / engine.scene().options.step));
}

bool NudgeTest::runs_away(const LaneEngine& engine, int slot, int object) const {
  const Before& before = before_[static_cast<std::size_t>(object)];
  const double drop = down_.dot(engine.center_of_mass(slot, object) - before.center);
  if (drop > kSunk) return true;
  // What has turned by enough below has sunk by this much.
  if (drop <= kLeastDrop * 0.5 * before.footing.height * kRunAway * kRunAway * kNudge * kNudge) return false;
  const Vector3d turn = geometry::log_rotation(engine.rotation(slot, object) * before.rotation.conjugate());
  // Turning about the vertical is no toppling.
  const double toppled = (turn - down_ * down_.dot(turn)).norm();
  return toppled > kRunAway * kNudge && drop > kLeastDrop * 0.5 * before.footing.height * toppled * toppled;
}

NudgeTest::Verdict NudgeTest::after_step(LaneEngine& engine, int slot) {
  for (int object = 0; object < engine.objects(); ++object) {
    if (!engine.free(slot, object) || !runs_away(engine, slot, object)) continue;
    engine.restore(slot, saved_);
    return Verdict::kRunsAway;
  }
  if (--left_ > 0) return Verdict::kGoesOn;
  engine.restore(slot, saved_);
  if (++axis_ == kNudgeAxes) {
    if (!next_object(engine, slot)) return Verdict::kReturns;
    axis_ = 0;
  }
  nudge(engine, slot);
  return Verdict::kGoesOn;
}

}  // namespace prescene::simulation
