// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/uncertain_shape_queries.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "critical_spheres.h"
#include "drawn_overlap.h"
#include "prescene/collision/spheres/static_shape_queries.h"
#include "prescene/core/random.h"
#include "uncertain_memory.h"

namespace prescene::collision {
namespace {

using geometry::Vector6d;

// Bounds this close leave an estimate little to be wrong by.
constexpr double kCloseBounds = 0.02;

/// P(some sphere touches) along the line of errors start + t direction: spheres are touched from some t on, or up to
/// one.
double along_line(const CriticalSpheres& critical, const Vector6d& start, const Vector6d& direction) {
  double from = std::numeric_limits<double>::infinity();
  double until = -from;
  for (const CriticalSphere& sphere : critical) {
    const double gap = sphere.gap + sphere.slope.dot(start);
    const double slope = sphere.slope.dot(direction);
    if (slope < 0.0) {
      from = std::min(from, -gap / slope);
    } else if (slope > 0.0) {
      until = std::max(until, -gap / slope);
    } else if (gap <= 0.0) {
      return 1.0;
    }
  }
  if (from <= until) return 1.0;
  return core::normal_cdf(-from) + core::normal_cdf(until);
}

void estimate(const CriticalSpheres& critical, const UncertainScratch::Memory& memory, UncertainOverlap* overlap) {
  const CriticalSphere& leader = critical.leader();
  const double length = leader.slope.norm();
  const Vector6d direction = length > 0.0 ? Vector6d(-leader.slope / length) : Vector6d(Vector6d::Unit(0));
  double sum = 0.0;
  double squares = 0.0;
  for (const Vector6d& point : memory.points) {
    const double p = along_line(critical, point - point.dot(direction) * direction, direction);
    sum += p;
    squares += p * p;
  }
  const auto count = static_cast<double>(memory.points.size());
  const double mean = sum / count;
  overlap->probability = std::clamp(mean, overlap->lower, overlap->upper);
  overlap->probability_error = 2.0 * std::sqrt(std::max(0.0, squares / count - mean * mean) / (count - 1.0));
}

}  // namespace

UncertainOverlap uncertain_overlap(const SphereTree& a, const StaticShape& b, const RelativeUncertainty& between,
                                   UncertainScratch& scratch) {
  UncertainScratch::Memory& memory = scratch.memory();
  const UncertainShape pair(a, b, between);
  CriticalSpheres& critical = memory.critical_spheres;
  pair.find_critical(&memory.nodes, &critical);

  UncertainOverlap overlap;
  overlap.lower = pair.lower(critical);
  overlap.upper = std::max(overlap.lower, pair.upper(critical));
  overlap.critical_pairs = static_cast<std::uint32_t>(critical.size);
  overlap.complete = critical.complete;
  if (critical.size == 0) return overlap;
  const double unsure = 1.0 - between.confidence() + RelativeUncertainty::kRemainderFails;
  if (overlap.upper <= unsure) {
    overlap.state = OverlapState::kNone;
  } else {
    overlap.state = overlap.lower >= 1.0 - unsure ? OverlapState::kCertain : OverlapState::kPossible;
  }
  if (overlap.state == OverlapState::kCertain) {
    overlap.probability = 0.5 * (overlap.lower + overlap.upper);
    overlap.probability_error = 0.5 * (overlap.upper - overlap.lower);
    return overlap;
  }
  const CriticalSphere& leader = critical.leader();
  const double missed = between.reversed_along(leader.normal).remainder(leader.centre);
  const bool of_first_order = critical.complete && is_small_error(missed, leader.deviation);
  if (of_first_order) estimate(critical, memory, &overlap);
  const bool is_plane = dynamic_cast<const HalfSpace*>(&b) != nullptr;
  if (of_first_order && (is_plane || overlap.upper - overlap.lower < kCloseBounds)) return overlap;

  // The shape may end beside its nearest place, or be rounder than the error is small.
  UncertainOverlap drawn = overlap;
  estimate_by_draws(
      between, memory, [&](const Transform& X_AB) { return collision::overlap(a, b, X_AB, memory.at_draws); }, &drawn);
  const double apart = std::abs(drawn.probability - overlap.probability);
  if (!of_first_order || apart > drawn.probability_error) return drawn;
  overlap.probability_error = std::max(overlap.probability_error, apart);
  return overlap;
}

}  // namespace prescene::collision
