// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/uncertain_sphere_queries.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "contact_bounds.h"
#include "drawn_overlap.h"
#include "prescene/core/random.h"
#include "prescene/core/sobol.h"
#include "uncertain_lanes.h"
#include "uncertain_memory.h"

namespace prescene::collision {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using geometry::Matrix6d;
using geometry::Vector6d;

// Any: the points are the same in every query, so that answers vary smoothly with their input.
constexpr std::uint64_t kNetSeed = 1;
// Pairs further apart touch with 0.13 % and push with 2e-4 of a deviation on average.
constexpr float kWrenchReach = 3.0F;

/// Standard normal points of a net.
template <int Dimensions, class Points>
void set_normal_points(Points* points) {
  const core::SobolNet net(Dimensions, kNetSeed);
  std::array<double, Dimensions> uniform{};
  for (std::size_t i = 0; i < points->size(); ++i) {
    net.point(i, uniform);
    for (int k = 0; k < Dimensions; ++k)
      (*points)[i][k] = core::inverse_normal_cdf(uniform[static_cast<std::size_t>(k)]);
  }
}

}  // namespace

UncertainScratch::UncertainScratch() : memory_(std::make_unique<Memory>()) {
  set_normal_points<6>(&memory_->points);
  memory_->draws.resize(Memory::kDraws);
  set_normal_points<12>(&memory_->draws);
}
UncertainScratch::~UncertainScratch() = default;
UncertainScratch::UncertainScratch(UncertainScratch&&) noexcept = default;
UncertainScratch& UncertainScratch::operator=(UncertainScratch&&) noexcept = default;

namespace {

/// Lines along the error that brings the most critical pair together, in the direction that closes its gap.
void set_lines(const CriticalPair& leader, const RelativeUncertainty& between,
               const std::array<Vector6d, ErrorLines::kCount>& points, ErrorLines* lines) {
  Vector6d direction = -between.displacement_at(leader.b).transpose() * leader.normal();
  const double length = direction.norm();
  direction = length > 0.0 ? Vector6d(direction / length) : Vector6d(Vector6d::Unit(0));
  for (std::size_t k = 0; k < 6; ++k) lines->direction[k] = static_cast<float>(direction[static_cast<Eigen::Index>(k)]);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector6d across = points[i] - points[i].dot(direction) * direction;
    for (std::size_t k = 0; k < 6; ++k) lines->start[i][k] = static_cast<float>(across[static_cast<Eigen::Index>(k)]);
  }
}

void estimate(const TouchingIntervals& intervals, UncertainOverlap* overlap) {
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t line = 0; line < ErrorLines::kCount; ++line) {
    double p = 0.0;
    for (std::size_t i = 0; i < intervals.count[line]; ++i) {
      p += core::normal_cdf(static_cast<double>(intervals.high[line][i])) -
           core::normal_cdf(static_cast<double>(intervals.low[line][i]));
    }
    sum += p;
    squares += p * p;
  }
  constexpr double kCount = ErrorLines::kCount;
  const double mean = sum / kCount;
  overlap->probability = std::clamp(mean, overlap->lower, overlap->upper);
  overlap->probability_error = 2.0 * std::sqrt(std::max(0.0, squares / kCount - mean * mean) / (kCount - 1.0));
}

}  // namespace

OverlapState overlap_state(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                           UncertainScratch& scratch) {
  if (!roots_may_meet(a, b, between, between.region_radius())) return OverlapState::kNone;
  return find_state(a, b, Swelling(between, b), &scratch.memory().stack);
}

UncertainOverlap uncertain_overlap(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                                   UncertainScratch& scratch) {
  UncertainOverlap overlap;
  if (!roots_may_meet(a, b, between, between.region_radius())) {
    overlap.upper = ContactBounds::outside(between);
    return overlap;
  }
  UncertainScratch::Memory& memory = scratch.memory();
  const Swelling swelling(between, b);
  memory.critical.pairs.size = 0;
  memory.critical.certain = false;
  find_critical_pairs(a, b, swelling, &memory.stack, &memory.critical);

  const ContactBounds bounds(a, b, between, memory.critical);
  overlap.lower = bounds.lower();
  overlap.upper = bounds.upper();
  overlap.critical_pairs = static_cast<std::uint32_t>(memory.critical.pairs.size);
  overlap.complete = memory.critical.complete;
  if (memory.critical.pairs.size == 0) return overlap;
  if (memory.critical.certain) {
    overlap.state = OverlapState::kCertain;
    overlap.probability = 0.5 * (overlap.lower + overlap.upper);
    overlap.probability_error = 0.5 * (overlap.upper - overlap.lower);
    return overlap;
  }
  overlap.state = OverlapState::kPossible;
  const double arm = (bounds.leader().b - between.pivot()).norm();
  if (!overlap.complete || !is_small_error(between.remainder(arm), between.deviation_bound(arm))) {
    estimate_by_draws(
        between, memory, [&](const Transform& X_AB) { return collision::overlap(a, b, X_AB, memory.at_draws); },
        &overlap);
    return overlap;
  }
  set_lines(bounds.leader(), between, memory.points, &memory.lines);
  intersect_lines(memory.critical, swelling, memory.lines, &memory.intervals);
  estimate(memory.intervals, &overlap);
  return overlap;
}

UncertainWrench uncertain_wrench(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                                 const PenaltyOptions& options, UncertainScratch& scratch) {
  if (!roots_may_meet(a, b, between, static_cast<double>(kWrenchReach))) return {};
  WrenchSums sums;
  sum_wrenches(a, b, Swelling(between, b), kWrenchReach, &scratch.memory().stack, &sums);

  UncertainWrench wrench;
  if (sums.pairs == 0.0) return wrench;
  const Eigen::Map<const Vector6d> mean(sums.sums.data() + WrenchSums::kMean);
  wrench.force = -options.stiffness * mean.head<3>();  // n points to B
  wrench.torque = -options.stiffness * mean.tail<3>();
  wrench.expected_pairs = sums.pairs;
  wrench.covariance = options.stiffness * options.stiffness * wrench_covariance(sums, between.factor());
  return about_point(wrench, options.p_AP);
}

}  // namespace prescene::collision
