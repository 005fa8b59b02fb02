// SPDX-License-Identifier: Apache-2.0
#include "critical_spheres.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "contact_bounds.h"
#include "error_half_spaces.h"
#include "prescene/collision/spheres/distance_probability.h"
#include "prescene/core/random.h"
#include "sphere_pairs.h"

namespace prescene::collision {

using Eigen::Vector3d;

namespace {

constexpr double kLargestMargin = 1e6;
// Places on the surface of a shape are off by no more, m.
constexpr double kOnSurface = 1e-9;
constexpr double kFails = RelativeUncertainty::kRemainderFails;

/// Keeps the spheres with the least ranks.
class Keeper {
 public:
  Keeper(double region, CriticalSpheres* critical) : critical_(*critical), region_(region) {
    critical_.size = 0;
    critical_.certain = false;
    critical_.complete = true;
    critical_.least_margin = kLargestMargin;
  }

  /// What has neither a rank nor a margin below this may be left out.
  double limit() const { return std::clamp(limit_, 0.0, region_); }
  bool wants(double rank, double margin) const { return rank < limit_ && margin < region_; }
  bool ended() const { return ended_; }
  void leave_out(double margin) {
    critical_.least_margin = std::min(critical_.least_margin, margin);
    if (margin < region_) critical_.complete = false;
  }
  void keep(const CriticalSphere& sphere) {
    if (!wants(sphere.rank, sphere.margin)) return leave_out(sphere.margin);
    critical_.least_margin = std::min(critical_.least_margin, sphere.margin);
    if (critical_.size < CriticalSpheres::kMost) {
      critical_.spheres[critical_.size++] = sphere;
    } else {
      leave_out(worst_->margin);
      *worst_ = sphere;
    }
    if (critical_.size < CriticalSpheres::kMost) return;
    worst_ = find_worst();
    limit_ = std::min(limit_, worst_->rank);
    // All touch at the mean: finding more of them would take as long as finding all.
    if (limit_ <= 0.0) end();
  }
  void keep_certain(const CriticalSphere& sphere) {
    if (critical_.size == CriticalSpheres::kMost) --critical_.size;
    critical_.spheres[critical_.size++] = sphere;
    critical_.certain = true;
    end();
  }

 private:
  CriticalSphere* find_worst() {
    return std::max_element(critical_.spheres.data(), critical_.spheres.data() + critical_.size,
                            [](const CriticalSphere& x, const CriticalSphere& y) { return x.rank < y.rank; });
  }
  void end() {
    ended_ = true;
    leave_out(-kLargestMargin);
  }

  CriticalSpheres& critical_;
  double region_;
  CriticalSphere* worst_ = nullptr;  // Once there is no more room.
  double limit_ = kLargestMargin;    // The largest rank kept once there is no more room.
  bool ended_ = false;
};

double in_deviations(double length, double deviation) {
  return std::clamp(length / std::max(deviation, kLeastDeviation), -kLargestMargin, kLargestMargin);
}

}  // namespace

CriticalSphere UncertainShape::look_at(const PackedSphere& sphere, const StaticShape::Nearest& nearest) const {
  CriticalSphere critical;
  critical.centre = sphere.centre.cast<double>();
  critical.radius = static_cast<double>(sphere.radius);
  critical.normal = placement_.R_AB * nearest.normal;
  critical.gap = nearest.distance - critical.radius;
  critical.slope = between_.slope_along(critical.normal, critical.centre);
  critical.deviation = critical.slope.norm();
  critical.rank = in_deviations(critical.gap, critical.deviation);
  return critical;
}

UncertainShape::Bounds UncertainShape::bounds_of(const PackedSphere& bounding,
                                                 const StaticShape::Nearest& nearest) const {
  const Vector3d c = bounding.centre.cast<double>();
  const auto radius = static_cast<double>(bounding.radius);
  const double far = to_pivot(c) + radius;
  const double gap = nearest.distance - radius;
  const double deviation = between_.deviation_bound(far);
  if (convex_ && nearest.distance > 0.0) {
    // What touches the shape has come to the plane before it.
    const Vector3d n = placement_.R_AB * nearest.normal;
    const double along_n = std::min(between_.slope_along(n, c).norm() + radius * along(n).tilt(), deviation);
    return {in_deviations(gap, along_n), in_deviations(gap - along(n).remainder(c, radius), along_n)};
  }
  // Distances change by at most the displacement.
  return {in_deviations(gap, deviation), in_deviations(gap - between_.reversed_remainder(far), deviation)};
}

const RelativeUncertainty::Along& UncertainShape::along(const Vector3d& n) const {
  if (n != along_.direction()) along_ = between_.reversed_along(n);
  return along_;
}

double UncertainShape::margin_of(const CriticalSphere& sphere) const {
  const bool outside = sphere.gap + sphere.radius > 0.0;
  if (convex_ && outside)
    return in_deviations(sphere.gap - along(sphere.normal).remainder(sphere.centre), sphere.deviation);
  const double far = to_pivot(sphere.centre);
  return in_deviations(sphere.gap - between_.reversed_remainder(far), between_.deviation_bound(far));
}

bool UncertainShape::is_certain(const CriticalSphere& sphere) const {
  const double far = to_pivot(sphere.centre);
  return -sphere.gap - between_.reversed_remainder(far) - between_.ball_radius() * between_.deviation_bound(far) >= 0.0;
}

void UncertainShape::find_critical(std::vector<UncertainScratch::Memory::OpenNode>* stack,
                                   CriticalSpheres* critical) const {
  const double region = between_.region_radius();
  Keeper keeper(region, critical);
  stack->clear();
  stack->push_back({0, -kLargestMargin, -kLargestMargin});
  while (!stack->empty() && !keeper.ended()) {
    const UncertainScratch::Memory::OpenNode open = stack->back();
    stack->pop_back();
    if (!keeper.wants(open.rank, open.margin)) {
      keeper.leave_out(open.margin);
      continue;
    }
    const SphereTree::Node& node = a_.nodes()[open.node];
    const std::size_t before = stack->size();
    for (std::uint32_t k = 0; k < node.count && !keeper.ended(); ++k) {
      const PackedSphere child = lane(a_, open.node, k);
      const auto radius = static_cast<double>(child.radius);
      const double far = to_pivot(child.centre.cast<double>()) + radius;
      const double reach =
          between_.reversed_remainder(far) + keeper.limit() * std::max(between_.deviation_bound(far), kLeastDeviation);
      const auto nearest = b_.nearest(placement_.to_shape(child.centre), radius + reach);
      if (!nearest) {
        keeper.leave_out(keeper.limit());
        continue;
      }
      if (!node.is_bottom()) {
        const Bounds bounds = bounds_of(child, *nearest);
        stack->push_back({node.first + k, bounds.rank, bounds.margin});
        continue;
      }
      CriticalSphere sphere = look_at(child, *nearest);
      sphere.margin = margin_of(sphere);
      is_certain(sphere) ? keeper.keep_certain(sphere) : keeper.keep(sphere);
    }
    std::sort(stack->begin() + static_cast<std::ptrdiff_t>(before), stack->end(),
              [](const auto& x, const auto& y) { return x.rank > y.rank; });
  }
}

namespace {

// Displacements sideways are in two dimensions: longer than k deviations with exp(-k^2 / 2).
double sideways_tail(double k) { return std::exp(-0.5 * k * k); }

}  // namespace

/// P(the sphere touches a ball in the shape whose centre is `apart` against the normal from its own).
double UncertainShape::touches_ball(const CriticalSphere& sphere, double ball, double apart) const {
  constexpr double kSideways = 6.0;
  const double far = to_pivot(sphere.centre);
  const double missed = between_.reversed_remainder(far);
  const double sideways =
      std::min(kSideways * between_.deviation_bound(far) + missed, between_.reversed_displacement(sphere.centre));
  double probability = 0.0;
  // Where the ball is large it is as good as flat.
  if (const double radii = sphere.radius + ball; sideways < radii) {
    const double half = std::sqrt((radii - sideways) * (radii + sideways));
    const double deviation = std::max(sphere.deviation, kLeastDeviation);
    const double missed_along = along(sphere.normal).remainder(sphere.centre);
    // Written so that nothing cancels where the ball is huge.
    const double depth = sphere.radius + (ball - apart) - sideways * sideways / (radii + half) - missed_along;
    probability = core::normal_cdf(depth / deviation) - core::normal_cdf((missed_along - apart - half) / deviation) -
                  sideways_tail(kSideways);
  }
  const double radii = sphere.radius + ball - missed;
  if (radii <= 0.0 || sideways < 1e-3 * radii) return probability;
  const Vector3d mean = apart * sphere.normal;
  const Eigen::Matrix3d covariance = between_.covariance_at(sphere.centre);
  return std::max({probability, distance_probability_bounds(mean, covariance, radii).lower,
                   distance_probability(mean, covariance, radii) - kDistanceProbabilityError});
}

/// Whether a convex shape holds a round prism about the sphere's normal, of that radius, that begins `from` behind the
/// nearest place and ends `to` behind it: by the corners of an octagon about it.
bool UncertainShape::contains_prism(const CriticalSphere& sphere, double radius, double from, double to) const {
  constexpr double kCorner = 1.0823922002923940;  // 1 / cos(pi / 8)
  const Vector3d n = placement_.R_AB.transpose() * sphere.normal;
  const Vector3d place = placement_.to_shape(sphere.centre) - (sphere.gap + sphere.radius) * n;
  const Vector3d u = n.unitOrthogonal();
  const Vector3d v = n.cross(u);
  for (int i = 0; i < 8; ++i) {
    const double angle = 0.25 * std::numbers::pi * i;
    const Vector3d corner = place + kCorner * radius * (std::cos(angle) * u + std::sin(angle) * v);
    if (!b_.is_within(corner - from * n, kOnSurface) || !b_.is_within(corner - to * n, kOnSurface)) return false;
  }
  return true;
}

/// P(the sphere touches the face that is nearest to it).
double UncertainShape::touches_face(const CriticalSphere& sphere) const {
  const double far = to_pivot(sphere.centre);
  const double missed = between_.reversed_remainder(far);
  const double most = between_.reversed_displacement(sphere.centre);
  const double distance = sphere.gap + sphere.radius;
  const double deviation = std::max(sphere.deviation, kLeastDeviation);
  // The shape's surface is known to that, m.
  const double slack = convex_ ? kOnSurface : kOnSurface + 0.01 * sphere.deviation;
  const double off = along(sphere.normal).remainder(sphere.centre) + 2.0 * slack;
  for (const double k : {6.0, 4.0, 3.0, 2.0, 1.0}) {
    double sideways = k * between_.deviation_bound(far) + missed;
    double tail = sideways_tail(k);
    if (most <= sideways) {
      sideways = most;
      tail = 0.0;
    }
    const std::optional<double> depth = face_depth(sphere, sideways, slack);
    if (!depth) continue;
    const double high = core::normal_cdf((sphere.radius - distance - off) / deviation);
    const double low = core::normal_cdf((off - sphere.radius - *depth - distance) / deviation);
    return high - low - tail;
  }
  return 0.0;
}

/// How deep the shape is at least within that radius of the place nearest to the sphere, where it is flat.
std::optional<double> UncertainShape::face_depth(const CriticalSphere& sphere, double radius, double slack) const {
  if (convex_) {
    for (const double depth : {1e4, 64.0 * sphere.radius, 8.0 * sphere.radius, sphere.radius, 0.0}) {
      if (contains_prism(sphere, radius, 0.0, depth)) return depth;
    }
    return std::nullopt;
  }
  const Vector3d n = placement_.R_AB.transpose() * sphere.normal;
  const Vector3d place = placement_.to_shape(sphere.centre) - (sphere.gap + sphere.radius) * n;
  if (b_.is_flat_about(place, n.normalized(), radius, slack)) return 0.0;
  return std::nullopt;
}

double UncertainShape::surely_touching(const CriticalSphere& sphere) const {
  // The shape's nearest place, or what it is inside of, and what is behind that.
  const double distance = sphere.gap + sphere.radius;
  double probability = touches_ball(sphere, std::max(0.0, -distance), std::max(0.0, distance));
  probability = std::max(probability, touches_face(sphere));
  if (!convex_) {
    const Vector3d centre = placement_.to_shape(sphere.centre);
    const Vector3d normal = placement_.R_AB.transpose() * sphere.normal;
    for (const double depth : {64.0 * sphere.radius, 8.0 * sphere.radius, sphere.radius}) {
      const double apart = distance + depth;
      const auto inside = b_.nearest(centre - apart * normal, 0.0);
      if (inside) probability = std::max(probability, touches_ball(sphere, std::min(-inside->distance, depth), apart));
    }
  }
  return std::max(0.0, probability - kFails);
}

double UncertainShape::lower(const CriticalSpheres& critical) const {
  if (critical.size == 0) return 0.0;
  const CriticalSphere& leader = critical.leader();
  double lower = surely_touching(leader);
  // One that is as deep, but where the shape may reach further.
  const CriticalSphere& deepest =
      *std::min_element(critical.begin(), critical.end(), [](const auto& x, const auto& y) { return x.gap < y.gap; });
  if (&deepest != &leader) lower = std::max(lower, surely_touching(deepest));
  if (critical.certain) lower = std::max(lower, between_.confidence() - kFails);
  return lower;
}

/// P(a sphere touches) is at most that, without kFails.
double UncertainShape::touching_bound(const CriticalSphere& sphere) const {
  if (sphere.margin <= 0.0) return 1.0;
  if (convex_) return core::normal_cdf(-sphere.margin);
  // Three normal numbers are that long: 2 (phi(m) m + Phi(-m)).
  const double m = sphere.margin;
  constexpr double kDensity = 0.3989422804014327;
  return 2.0 * (kDensity * std::exp(-0.5 * m * m) * m + core::normal_cdf(-m));
}

/// Where the shape is behind a plane and all spheres are before it, the bodies touch only if a sphere crosses it. How
/// far the body comes changes linearly along the plane, so that one of the corners of a rectangle about it crosses,
/// too.
double UncertainShape::crossing_bound(const CriticalSphere& leader) const {
  const Vector3d& n = leader.normal;
  const double distance = leader.gap + leader.radius;
  if (distance <= 0.0) return 1.0;
  const Vector3d middle = a_.root().centre.cast<double>();
  const auto radius = static_cast<double>(a_.root().radius);
  double plane = n.dot(leader.centre) - distance;
  double outside = kFails;
  if (!convex_) {
    // Only what the body may reach matters.
    const double far = to_pivot(middle) + radius;
    const double moved = between_.region_radius() * between_.deviation_bound(far) + between_.reversed_remainder(far);
    const Vector3d normal = placement_.R_AB.transpose() * n;
    const double reach =
        b_.reach_along(normal.normalized(), placement_.to_shape(middle), static_cast<double>(a_.root().radius) + moved);
    plane = std::max(plane, reach + n.dot(placement_.p_AB));
    outside += 1.0 - between_.confidence();
  }
  const double lowest = -reach_along(a_, -n, 0.02 * leader.deviation);
  const double gap = lowest - plane - along(n).remainder(middle, radius);
  if (gap <= 0.0) return 1.0;
  std::array<Vector3d, 2> side;
  side[0] = n.unitOrthogonal();
  side[1] = n.cross(side[0]);
  std::array<std::array<double, 2>, 2> range{};
  for (std::size_t k = 0; k < 2; ++k) {
    const double slack = 0.01 * radius;
    range[k] = {-reach_along(a_, -side[k], slack), reach_along(a_, side[k], slack)};
  }
  ErrorHalfSpaces corners;
  for (const auto& [i, j] : {std::pair(0U, 0U), std::pair(0U, 1U), std::pair(1U, 1U), std::pair(1U, 0U)}) {
    const Vector3d corner = lowest * n + range[0][i] * side[0] + range[1][j] * side[1];
    corners.add(between_.slope_along(-n, corner), gap);
  }
  return corners.probability() + outside;
}

double UncertainShape::upper(const CriticalSpheres& critical) const {
  const double outside = 1.0 - between_.confidence() + kFails;
  if (critical.size == 0) return std::min(outside, six_dimensional_tail(std::max(0.0, critical.least_margin)) + kFails);
  double sum = 0.0;
  for (const CriticalSphere& sphere : critical) sum += touching_bound(sphere);
  double upper = six_dimensional_tail(std::max(0.0, critical.least_margin)) + kFails;
  if (critical.complete) upper = std::min(upper, sum + outside);
  if (critical.leader().gap > 0.0) upper = std::min(upper, crossing_bound(critical.leader()));
  return std::min(1.0, upper);
}

}  // namespace prescene::collision
