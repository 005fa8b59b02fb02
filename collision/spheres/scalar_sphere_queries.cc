// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/scalar_sphere_queries.h"

#include <array>

#include "sphere_pairs.h"

namespace prescene::collision {

double lens_volume(double radius_a, double radius_b, double d) {
  const double depth = radius_a + radius_b - d;
  if (depth <= 0.0) return 0.0;
  const double difference = radius_a - radius_b;
  if (d <= std::abs(difference)) return 4.0 / 3.0 * std::numbers::pi * std::pow(std::min(radius_a, radius_b), 3);
  return std::numbers::pi / 12.0 * depth * depth *
         (d * d + 2.0 * d * (radius_a + radius_b) - 3.0 * difference * difference) / d;
}

namespace scalar {
namespace {

using Eigen::Vector3d;
using NodePair = SphereScratch::NodePair;

// Children of a node of B in A's frame.
struct Placed {
  std::array<PackedSphere, SphereTree::kMostBranching> children;
};

Placed place(const SphereTree& b, std::uint32_t node, const Transform& X_AB) {
  Placed result;
  for (std::size_t k = 0; k < b.nodes()[node].count; ++k) result.children[k] = placed(X_AB, lane(b, node, k));
  return result;
}

// Calls found(sphere of A, sphere of B, places) for each pair of spheres that overlap, or are up to `range` apart,
// until it returns true; then returns true.
template <class Found>
bool for_overlapping(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch,
                     const Found& found, float range = 0.0F) {
  const float slack = slack_of(a, b, X_AB) + range;
  const PackedSphere root_b = placed(X_AB, b.root());
  if (!meet(a.root(), root_b, slack)) return false;
  scratch.pairs.clear();
  scratch.pairs.push_back({0, 0, a.root(), root_b, 0.0F});
  while (!scratch.pairs.empty()) {
    const NodePair pair = scratch.pairs.back();
    scratch.pairs.pop_back();
    const SphereTree::Node& node_a = a.nodes()[pair.a];
    const SphereTree::Node& node_b = b.nodes()[pair.b];
    const Placed children_b = place(b, pair.b, X_AB);
    std::uint32_t met_b = 0;  // Children of b that meet a child of a, when only b is descended.
    for (std::uint32_t i = 0; i < node_a.count; ++i) {
      const PackedSphere child_a = lane(a, pair.a, i);
      if (!meet(child_a, pair.sphere_b, slack)) continue;
      bool met_a = false;
      for (std::uint32_t k = 0; k < node_b.count; ++k) {
        const PackedSphere& child_b = children_b.children[k];
        const bool leaves = node_a.is_bottom() && node_b.is_bottom();
        if (!meet(child_a, child_b, leaves ? range : slack)) continue;
        if (leaves) {
          if (found(child_a, child_b, SpherePair{node_a.first + i, node_b.first + k})) return true;
        } else if (node_a.is_bottom()) {
          met_b |= 1U << k;
        } else if (node_b.is_bottom()) {
          met_a = true;
          break;
        } else {
          scratch.pairs.push_back({node_a.first + i, node_b.first + k, child_a, child_b, 0.0F});
        }
      }
      if (met_a) scratch.pairs.push_back({node_a.first + i, pair.b, child_a, pair.sphere_b, 0.0F});
    }
    for (std::uint32_t k = 0; met_b != 0; ++k, met_b >>= 1U) {
      if ((met_b & 1U) != 0)
        scratch.pairs.push_back({pair.a, node_b.first + k, pair.sphere_a, children_b.children[k], 0.0F});
    }
  }
  return false;
}

float gap(const PackedSphere& a, const PackedSphere& b) {
  return std::sqrt(
             squared_length(b.centre.x() - a.centre.x(), b.centre.y() - a.centre.y(), b.centre.z() - a.centre.z())) -
         (a.radius + b.radius);
}

}  // namespace

bool overlap(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch) {
  return for_overlapping(a, b, X_AB, scratch,
                         [](const PackedSphere&, const PackedSphere&, const SpherePair&) { return true; });
}

SphereOverlap overlap_volume(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SphereScratch& scratch) {
  SphereOverlap sum;
  for_overlapping(a, b, X_AB, scratch, [&](const PackedSphere& sphere_a, const PackedSphere& sphere_b, SpherePair) {
    // In single precision like the vector code, for the same sums and as fair a measure.
    const float d =
        std::sqrt(squared_length(sphere_b.centre.x() - sphere_a.centre.x(), sphere_b.centre.y() - sphere_a.centre.y(),
                                 sphere_b.centre.z() - sphere_a.centre.z()));
    const float total = sphere_a.radius + sphere_b.radius;
    const float difference = sphere_a.radius - sphere_b.radius;
    const float depth = total - d;
    const float smaller = std::min(sphere_a.radius, sphere_b.radius);
    const float lens = d <= std::abs(difference)
                           ? 16.0F * (smaller * smaller * smaller)
                           : (depth * depth) * ((d * d + 2.0F * (d * total)) - 3.0F * (difference * difference)) / d;
    sum.volume += static_cast<double>(lens);
    ++sum.pairs;
    return false;
  });
  sum.volume *= std::numbers::pi / 12.0;
  return sum;
}

bool contacts(const SphereTree& a, const SphereTree& b, const Transform& X_AB, std::size_t limit,
              std::vector<SphereContact>* contacts, SphereScratch& scratch) {
  const std::size_t most = contacts->size() + limit;
  const auto found = [&](const PackedSphere& sphere_a, const PackedSphere& sphere_b, SpherePair places) {
    if (contacts->size() == most) return true;
    contacts->push_back(make_contact(a, b, sphere_a, sphere_b, places));
    return false;
  };
  return !for_overlapping(a, b, X_AB, scratch, found);
}

void near_pairs(const SphereTree& a, const SphereTree& b, const Transform& X_AB, double range,
                std::vector<SpherePair>* pairs, SphereScratch& scratch) {
  const auto found = [&](const PackedSphere&, const PackedSphere&, SpherePair places) {
    pairs->push_back({a.order()[places.a], b.order()[places.b]});
    return false;
  };
  for_overlapping(a, b, X_AB, scratch, found, static_cast<float>(range));
}

PenaltyWrench penalty_wrench(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                             const PenaltyOptions& options, SphereScratch& scratch) {
  PenaltyWrench sum;
  for_overlapping(a, b, X_AB, scratch, [&](const PackedSphere& sphere_a, const PackedSphere& sphere_b, SpherePair) {
    const Vector3d centre = sphere_a.centre.cast<double>();
    const Vector3d apart = centre - sphere_b.centre.cast<double>();
    const double d = apart.norm();
    const double half =
        0.5 * std::max(0.0, static_cast<double>(sphere_a.radius) + static_cast<double>(sphere_b.radius) - d);
    const Vector3d push = d > 0.0 ? Vector3d(apart * (half / d)) : Vector3d(Vector3d::Zero());
    sum.force += push;
    sum.torque += (centre - options.p_AP).cross(push);
    sum.energy += half * half;
    ++sum.pairs;
    return false;
  });
  sum.force *= options.stiffness;
  sum.torque *= options.stiffness;
  sum.energy *= options.stiffness;
  return sum;
}

std::optional<SphereDistance> distance(const SphereTree& a, const SphereTree& b, const Transform& X_AB,
                                       SphereScratch& scratch, double below, std::optional<SpherePair> seed) {
  std::optional<SphereDistance> best;
  const auto take = [&](const SphereDistance& found) {
    if (found.distance < (best ? best->distance : below)) best = found;
  };
  if (seed && is_pair_of(a, b, *seed)) take(distance_of(a, b, X_AB, *seed));
  const float slack = slack_of(a, b, X_AB);
  const PackedSphere root_b = placed(X_AB, b.root());
  scratch.pairs.clear();
  scratch.pairs.push_back({0, 0, a.root(), root_b, gap(a.root(), root_b) - slack});
  const auto limit = [&] { return best ? best->distance : below; };
  while (!scratch.pairs.empty()) {
    const NodePair pair = scratch.pairs.back();
    scratch.pairs.pop_back();
    if (static_cast<double>(pair.bound) >= limit()) continue;
    const SphereTree::Node& node_a = a.nodes()[pair.a];
    const SphereTree::Node& node_b = b.nodes()[pair.b];
    const std::size_t before = scratch.pairs.size();
    if (node_a.is_bottom() && node_b.is_bottom()) {
      const Placed children_b = place(b, pair.b, X_AB);
      for (std::uint32_t i = 0; i < node_a.count; ++i) {
        const PackedSphere child_a = lane(a, pair.a, i);
        for (std::uint32_t k = 0; k < node_b.count; ++k) {
          if (static_cast<double>(gap(child_a, children_b.children[k]) - slack) < limit())
            take(distance_of(a, b, X_AB, {a.order()[node_a.first + i], b.order()[node_b.first + k]}));
        }
      }
    } else if (node_b.is_bottom() || (!node_a.is_bottom() && pair.sphere_a.radius >= pair.sphere_b.radius)) {
      for (std::uint32_t i = 0; i < node_a.count; ++i) {
        const PackedSphere child_a = lane(a, pair.a, i);
        scratch.pairs.push_back(
            {node_a.first + i, pair.b, child_a, pair.sphere_b, gap(child_a, pair.sphere_b) - slack});
      }
    } else {
      for (std::uint32_t k = 0; k < node_b.count; ++k) {
        const PackedSphere child_b = placed(X_AB, lane(b, pair.b, k));
        scratch.pairs.push_back(
            {pair.a, node_b.first + k, pair.sphere_a, child_b, gap(pair.sphere_a, child_b) - slack});
      }
    }
    // The nearest first.
    std::sort(scratch.pairs.begin() + static_cast<std::ptrdiff_t>(before), scratch.pairs.end(),
              [](const NodePair& x, const NodePair& y) { return x.bound > y.bound; });
  }
  return best;
}

}  // namespace scalar
}  // namespace prescene::collision
