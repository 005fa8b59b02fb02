// SPDX-License-Identifier: Apache-2.0
#include "contact_bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "error_half_spaces.h"
#include "prescene/collision/spheres/distance_probability.h"
#include "prescene/core/random.h"

namespace prescene::collision {

namespace {

using Eigen::Vector3d;

double remainder_at(const RelativeUncertainty& between, const Vector3d& p) {
  return between.remainder((p - between.pivot()).norm());
}

/// What a pair alone says: it touches when the distance of its centres, displaced to first order, is less by the
/// remainder.
double surely_touching(const CriticalPair& pair, const RelativeUncertainty& between) {
  const double radii = pair.radii - remainder_at(between, pair.b);
  const Vector3d mean = pair.b - pair.a;
  const Eigen::Matrix3d covariance = between.covariance_at(pair.b);
  const ProbabilityBounds bounds = distance_probability_bounds(mean, covariance, radii);
  double probability = bounds.lower;
  if (bounds.upper - bounds.lower > 2.0 * kDistanceProbabilityError)
    probability = std::max(probability, distance_probability(mean, covariance, radii) - kDistanceProbabilityError);
  return std::max(0.0, probability - RelativeUncertainty::kRemainderFails);
}

/// Share of the errors along a pair's normal that let it touch: what ranks pairs that are not looked at further.
double along_normal(const CriticalPairs& critical, std::size_t i, double deviation) {
  const auto margin = static_cast<double>(critical.margin[i]);
  const double width = deviation > 0.0 ? 2.0 * static_cast<double>(critical.pairs.radii[i]) / deviation : 1e6;
  return core::normal_cdf(-margin) - core::normal_cdf(-margin - width);
}

/// Bodies on both sides of a plane across `normal` touch only if some point of B crosses it. The height of B's points
/// over the plane changes linearly with their place along the plane, so that one of the corners of a rectangle about
/// all that may touch crosses it, too.
double crossing_bound(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                      const Vector3d& normal, double tolerance) {
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> rotation(between.X_AB().rotation.data());
  const Eigen::Matrix3d R_AB = rotation.cast<double>();
  const Vector3d p_AB = Eigen::Map<const Vector3f>(between.X_AB().translation.data()).cast<double>();
  const auto high_a = [&](const Vector3d& n, double slack) { return reach_along(a, n, slack); };
  const auto high_b = [&](const Vector3d& n, double slack) {
    return n.dot(p_AB) + reach_along(b, R_AB.transpose() * n, slack);
  };
  const double plane = high_a(normal, tolerance);
  const double lowest = -high_b(-normal, tolerance);
  if (lowest <= plane) return 1.0;

  const Vector3d middle = R_AB * b.root().centre.cast<double>() + p_AB;
  const double far = (middle - between.pivot()).norm() + static_cast<double>(b.root().radius);
  const double missed = between.remainder(far);
  const double moved = between.region_radius() * between.deviation_bound(far) + missed;
  const double unknown = std::numeric_limits<double>::infinity();
  std::array<Vector3d, 2> side;
  side[0] = normal.unitOrthogonal();
  side[1] = normal.cross(side[0]);
  std::array<std::array<double, 2>, 2> range{};
  for (std::size_t k = 0; k < 2; ++k) {
    range[k] = {std::max(-high_b(-side[k], unknown), -high_a(-side[k], unknown) - moved),
                std::min(high_b(side[k], unknown), high_a(side[k], unknown) + moved)};
    if (range[k][0] > range[k][1]) return 0.0;
  }
  ErrorHalfSpaces corners;
  for (const auto& [i, j] : {std::pair(0U, 0U), std::pair(0U, 1U), std::pair(1U, 1U), std::pair(1U, 0U)}) {
    const Vector3d corner = lowest * normal + range[0][i] * side[0] + range[1][j] * side[1];
    corners.add(-between.displacement_at(corner).transpose() * normal, lowest - plane - missed);
  }
  return corners.probability();
}

}  // namespace

Vector3d CriticalPair::normal() const {
  const Vector3d difference = b - a;
  const double length = difference.norm();
  return length > 0.0 ? Vector3d(difference / length) : Vector3d(Vector3d::UnitX());
}

CriticalPair pair_at(const CriticalPairs& pairs, std::size_t i) {
  CriticalPair pair;
  for (std::size_t k = 0; k < 3; ++k) {
    pair.a[static_cast<Eigen::Index>(k)] = static_cast<double>(pairs.pairs.a[k][i]);
    pair.b[static_cast<Eigen::Index>(k)] = static_cast<double>(pairs.pairs.b[k][i]);
  }
  pair.radii = static_cast<double>(pairs.pairs.radii[i]);
  return pair;
}

ContactBounds::ContactBounds(const SphereTree& a, const SphereTree& b, const RelativeUncertainty& between,
                             const CriticalPairs& critical) {
  const double fails = RelativeUncertainty::kRemainderFails;
  const double outside_region = outside(between);
  const std::size_t size = critical.pairs.size;
  if (size == 0) {
    upper_ = outside_region;
    return;
  }
  const float* margins = critical.margin.data();
  const auto leading = static_cast<std::size_t>(std::min_element(margins, margins + size) - margins);
  leader_ = pair_at(critical, leading);

  // Lower: the pair whose share of errors along the normal is largest, and the one with the least margin.
  const double deviation = between.deviation_bound((leader_.b - between.pivot()).norm());
  std::size_t likely = leading;
  double best = -1.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < size; ++i) {
    const double share = along_normal(critical, i, deviation);
    sum += core::normal_cdf(-static_cast<double>(margins[i]));
    if (share > best) {
      best = share;
      likely = i;
    }
  }
  lower_ = surely_touching(leader_, between);
  if (likely != leading) lower_ = std::max(lower_, surely_touching(pair_at(critical, likely), between));
  if (critical.certain) lower_ = std::max(lower_, 1.0 - outside_region);

  // Upper: no shorter error than the least margin, or all pairs one by one, or a plane between the bodies.
  const double nearest = std::min(static_cast<double>(margins[leading]), between.region_radius());
  upper_ = std::min(1.0, six_dimensional_tail(nearest) + fails);
  if (critical.complete) upper_ = std::min(upper_, sum + outside_region);
  if (nearest > 0.0) {
    const double crossing = crossing_bound(a, b, between, leader_.normal(), 0.05 * deviation);
    upper_ = std::min(upper_, crossing + outside_region);
  }
  upper_ = std::max(upper_, lower_);
}

double reach_along(const SphereTree& tree, const Vector3d& direction, double tolerance) {
  constexpr std::size_t kMostNodes = 64;
  constexpr double kRounding = 1e-6;
  struct Entry {
    std::uint32_t node;
    double reach;
  };
  std::array<Entry, kMostNodes * SphereTree::kMostBranching> entries;
  std::size_t size = 0;
  const Vector3f n = direction.cast<float>();
  const PackedSphere& root = tree.root();
  entries[size++] = {0, direction.dot(root.centre.cast<double>()) + static_cast<double>(root.radius)};
  double found = -std::numeric_limits<double>::infinity();
  const auto less = [](const Entry& x, const Entry& y) { return x.reach < y.reach; };
  // The node that reaches furthest is opened next: when a sphere reaches as far, no node can hold more.
  for (std::size_t opened = 0; size > 0; ++opened) {
    const Entry top = entries[0];
    if (top.reach <= found + tolerance || opened == kMostNodes) {
      found = std::max(found, top.reach);
      break;
    }
    std::pop_heap(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(size), less);
    --size;
    const SphereTree::Node& node = tree.nodes()[top.node];
    const float* lanes = tree.lanes(top.node);
    const std::size_t stride = tree.branching();
    for (std::uint32_t k = 0; k < node.count; ++k) {
      const auto reach = static_cast<double>(n.x() * lanes[k] + n.y() * lanes[stride + k] +
                                             n.z() * lanes[2 * stride + k] + lanes[3 * stride + k]);
      if (node.is_bottom()) {
        found = std::max(found, reach);
      } else if (reach > found) {
        entries[size++] = {node.first + k, std::min(reach, top.reach)};
        std::push_heap(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(size), less);
      }
    }
  }
  return found + kRounding * (std::abs(found) + root.centre.cast<double>().norm() + static_cast<double>(root.radius));
}

}  // namespace prescene::collision
