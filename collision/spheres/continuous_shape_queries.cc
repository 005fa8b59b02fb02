// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/continuous_shape_queries.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prescene/core/check.h"
#include "shape_placement.h"
#include "sphere_pairs.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

struct Earliest {
  double time = 1.0;
  bool found = false;
  std::uint32_t place = 0;  // In the tree's order.

  void offer(double t, std::uint32_t of_place) {
    if (t > time || (found && t == time && of_place > place)) return;
    *this = {t, true, of_place};
  }
};

float rounded_down(double x) { return std::nextafter(static_cast<float>(x), -std::numeric_limits<float>::infinity()); }

// Looks at all spheres that may touch before motion.earliest, near ones first. A motion knows when, at the earliest,
// the sphere about a node's spheres touches, and offers the times of the packing's spheres.
template <class Motion>
void sweep(const SphereTree& a, SweepScratch& scratch, Motion& motion) {
  std::vector<SweepScratch::Entry>& stack = scratch.entries();
  stack.clear();
  if (const auto time = motion.reaches(a.root())) stack.push_back({0, 0, rounded_down(*time)});
  while (!stack.empty()) {
    const SweepScratch::Entry entry = stack.back();
    stack.pop_back();
    if (static_cast<double>(entry.time) > motion.earliest.time) continue;
    const SphereTree::Node& node = a.nodes()[entry.a];
    const std::size_t before = stack.size();
    for (std::uint32_t k = 0; k < node.count; ++k) {
      const PackedSphere child = lane(a, entry.a, k);
      if (node.is_bottom()) {
        motion.meet(child, node.first + k);
      } else if (const auto time = motion.reaches(child); time && *time <= motion.earliest.time) {
        stack.push_back({node.first + k, 0, rounded_down(*time)});
      }
    }
    std::sort(stack.begin() + static_cast<std::ptrdiff_t>(before), stack.end(),
              [](const auto& x, const auto& y) { return x.time > y.time; });
  }
}

// When a sphere that moves along a straight line touches the shape, or a little earlier: what prunes need not be exact,
// and shapes with many parts answer nearest() faster. Distances shrink by at most the way.
std::optional<double> reaches_about(const StaticShape& b, const Vector3d& from, const Vector3d& to, double radius,
                                    double until) {
  if (b.is_convex()) return b.swept_sphere_contact(from, to, radius);
  constexpr int kMostSteps = 8;
  constexpr double kNear = 0.25;
  const double way = (to - from).norm();
  double t = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    const auto nearest = b.nearest(from + t * (to - from), (radius + (until - t) * way) * (1.0 + 1e-12) + 1e-300);
    if (!nearest) return std::nullopt;
    const double gap = nearest->distance - radius;
    if (gap <= kNear * radius || way <= 0.0) break;
    t += gap / way * (1.0 - 1e-12);
    if (t > until) return std::nullopt;
  }
  return t;
}

class StraightMotion {
 public:
  StraightMotion(const SphereTree& a, const StaticShape& b, const Transform& start, const Transform& end)
      : b_(b), start_(a, start), end_(a, end) {}

  std::optional<double> reaches(const PackedSphere& bounding) const {
    const double slack = std::max(start_.slack, end_.slack);
    return reaches_about(b_, start_.to_shape(bounding.centre), end_.to_shape(bounding.centre),
                         static_cast<double>(bounding.radius) + slack, earliest.time);
  }
  void meet(const PackedSphere& sphere, std::uint32_t place) {
    const Vector3d from = start_.to_shape(sphere.centre);
    const Vector3d to = end_.to_shape(sphere.centre);
    const auto radius = static_cast<double>(sphere.radius);
    // Only what is left of the way matters.
    const auto begin = b_.is_convex() ? std::optional(0.0) : reaches_about(b_, from, to, radius, earliest.time);
    if (!begin) return;
    const double length = earliest.time - *begin;
    const auto share = b_.swept_sphere_contact(from + *begin * (to - from), from + earliest.time * (to - from), radius);
    if (share) earliest.offer(*begin + *share * length, place);
  }
  Vector3d centre(const Vector3f& c, double t) const {
    const Vector3d from = start_.to_shape(c);
    return from + t * (end_.to_shape(c) - from);
  }
  Vector3d to_body(const Vector3d& v, double t) const {
    const Vector3d turned = (1.0 - t) * (start_.R_AB * v) + t * (end_.R_AB * v);
    const double length = turned.norm();
    return length > 0.0 ? Vector3d(turned / length) : v;
  }

  Earliest earliest;

 private:
  const StaticShape& b_;
  ShapePlacement start_;
  ShapePlacement end_;
};

// Within a piece [begin, end] of a screw. Going back along B's screw, A's points move in B as they do in A but for the
// pose at the start.
class TurningMotion {
 public:
  TurningMotion(const StaticShape& b, const ScrewMotion& motion, double tolerance)
      : b_(b), motion_(motion), X_BA_(motion.start().inverse()), tolerance_(tolerance) {}

  void set_piece(double begin, double end) {
    begin_ = begin;
    end_ = end;
    earliest.time = end;
  }

  std::optional<double> reaches(const PackedSphere& bounding) const {
    const auto radius = static_cast<double>(bounding.radius);
    const double length = end_ - begin_;
    const double bend = motion_.bend(bounding.centre.cast<double>()) + motion_.spin().squaredNorm() * radius;
    const auto share =
        reaches_about(b_, centre(bounding.centre, begin_), centre(bounding.centre, end_),
                      (radius + 0.125 * bend * length * length) * (1.0 + 1e-12), (earliest.time - begin_) / length);
    if (!share) return std::nullopt;
    return begin_ + *share * length;
  }

  void meet(const PackedSphere& sphere, std::uint32_t place) {
    const auto radius = static_cast<double>(sphere.radius);
    const Vector3d c = sphere.centre.cast<double>();
    const double speed = motion_.speed(c);
    const double bend = motion_.bend(c);
    // On chords of this length the sphere is off by half the tolerance at most.
    const double chord = bend > 0.0 ? std::sqrt(4.0 * tolerance_ / bend) : 2.0;
    double t = begin_;
    while (true) {
      const Vector3d from = centre(sphere.centre, t);
      const auto near = b_.nearest(from, radius + speed * (earliest.time - t) + tolerance_);
      if (!near) return;
      const double gap = near->distance - radius;
      if (gap <= 0.0) return earliest.offer(t, place);
      if (t >= earliest.time || speed <= 0.0) return;
      // It takes that long to close the gap, however the sphere moves.
      const double free = gap / speed;
      if (free > chord) {
        t += free;
        if (t > earliest.time) return;
        continue;
      }
      const double next = std::min(t + chord, end_);
      const double off = 0.125 * bend * (next - t) * (next - t);
      if (const auto share = b_.swept_sphere_contact(from, centre(sphere.centre, next), radius + off))
        return earliest.offer(t + *share * (next - t), place);
      if (next >= earliest.time) return;
      t = next;
    }
  }

  Vector3d centre(const Vector3f& c, double t) const { return X_BA_ * motion_.place(c.cast<double>(), -t); }
  Vector3d to_body(const Vector3d& v, double t) const { return motion_.pose(t).rotation * v; }

  Earliest earliest;

 private:
  const StaticShape& b_;
  const ScrewMotion& motion_;
  geometry::Pose X_BA_;
  double tolerance_;
  double begin_ = 0.0;
  double end_ = 1.0;
};

template <class Motion>
ShapeImpact impact_of(const SphereTree& a, const StaticShape& b, const Motion& motion) {
  ShapeImpact impact;
  impact.time = motion.earliest.time;
  impact.sphere = a.order()[motion.earliest.place];
  const PackedSphere& sphere = a.packing().spheres()[impact.sphere];
  const auto nearest = b.nearest(motion.centre(sphere.centre, impact.time), std::numeric_limits<double>::infinity());
  PRESCENE_CHECK(nearest.has_value());
  impact.normal = -motion.to_body(nearest->normal, impact.time);
  impact.point = sphere.centre.cast<double>() + static_cast<double>(sphere.radius) * impact.normal;
  return impact;
}

bool is_finite(const Transform& X) {
  const auto finite = [](float x) { return std::isfinite(x); };
  return std::all_of(X.rotation.begin(), X.rotation.end(), finite) &&
         std::all_of(X.translation.begin(), X.translation.end(), finite);
}

int pieces_of(const SphereTree& a, const ScrewMotion& motion) {
  const auto radius = static_cast<double>(a.root().radius);
  const double bend = motion.bend(a.root().centre.cast<double>()) + motion.spin().squaredNorm() * radius;
  return chord_pieces(bend, kChordDeviation * radius);
}

}  // namespace

std::optional<ShapeImpact> time_of_impact(const SphereTree& a, const StaticShape& b, const Transform& X_AB_start,
                                          const Transform& X_AB_end, SweepScratch& scratch) {
  if (!is_finite(X_AB_start) || !is_finite(X_AB_end)) return std::nullopt;
  StraightMotion motion(a, b, X_AB_start, X_AB_end);
  sweep(a, scratch, motion);
  if (!motion.earliest.found) return std::nullopt;
  return impact_of(a, b, motion);
}

std::optional<ShapeImpact> time_of_impact(const SphereTree& a, const StaticShape& b, const ScrewMotion& motion,
                                          const ImpactOptions& options, SweepScratch& scratch) {
  TurningMotion turning(b, motion, std::max(kLeastImpactTolerance, options.tolerance));
  const int count = pieces_of(a, motion);
  for (int i = 0; i < count && !turning.earliest.found; ++i) {
    turning.set_piece(static_cast<double>(i) / count, i + 1 == count ? 1.0 : static_cast<double>(i + 1) / count);
    sweep(a, scratch, turning);
  }
  if (!turning.earliest.found) return std::nullopt;
  return impact_of(a, b, turning);
}

}  // namespace prescene::collision
