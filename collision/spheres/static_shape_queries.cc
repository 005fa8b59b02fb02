// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/static_shape_queries.h"

#include <cmath>
#include <numbers>

#include "shape_placement.h"
#include "sphere_pairs.h"

namespace prescene::collision {
namespace {

using Eigen::Vector3d;

// Calls found(sphere, nearest, place) for each sphere that overlaps until it returns true; then returns true.
template <class Found>
bool for_overlapping(const SphereTree& a, const StaticShape& b, const ShapePlacement& placement, SphereScratch& scratch,
                     const Found& found) {
  std::vector<std::uint32_t>& stack = scratch.nodes_a;
  stack.clear();
  if (!b.is_within(placement.to_shape(a.root().centre), static_cast<double>(a.root().radius) + placement.slack))
    return false;
  stack.push_back(0);
  while (!stack.empty()) {
    const std::uint32_t index = stack.back();
    stack.pop_back();
    const SphereTree::Node& node = a.nodes()[index];
    for (std::uint32_t k = 0; k < node.count; ++k) {
      const PackedSphere child = lane(a, index, k);
      const Vector3d centre = placement.to_shape(child.centre);
      const auto radius = static_cast<double>(child.radius);
      if (!node.is_bottom()) {
        if (b.is_within(centre, radius + placement.slack)) stack.push_back(node.first + k);
        continue;
      }
      const auto nearest = b.nearest(centre, std::nextafter(radius, 2.0 * radius));
      if (nearest && found(child, *nearest, node.first + k)) return true;
    }
  }
  return false;
}

double cap_volume(double radius, double height) {
  const double h = std::clamp(height, 0.0, 2.0 * radius);
  return std::numbers::pi / 3.0 * h * h * (3.0 * radius - h);
}

}  // namespace

bool overlap(const SphereTree& a, const StaticShape& b, const Transform& X_AB, SphereScratch& scratch) {
  return for_overlapping(a, b, ShapePlacement(a, X_AB), scratch,
                         [](const PackedSphere&, const StaticShape::Nearest&, std::uint32_t) { return true; });
}

SphereOverlap overlap_volume(const SphereTree& a, const StaticShape& b, const Transform& X_AB, SphereScratch& scratch) {
  SphereOverlap overlap;
  for_overlapping(a, b, ShapePlacement(a, X_AB), scratch,
                  [&](const PackedSphere& sphere, const StaticShape::Nearest& nearest, std::uint32_t) {
                    const auto radius = static_cast<double>(sphere.radius);
                    overlap.volume += cap_volume(radius, radius - nearest.distance);
                    ++overlap.pairs;
                    return false;
                  });
  return overlap;
}

bool contacts(const SphereTree& a, const StaticShape& b, const Transform& X_AB, std::size_t limit,
              std::vector<ShapeContact>* contacts, SphereScratch& scratch) {
  const std::size_t most = contacts->size() + limit;
  const ShapePlacement placement(a, X_AB);
  const auto found = [&](const PackedSphere& sphere, const StaticShape::Nearest& nearest, std::uint32_t place) {
    if (contacts->size() == most) return true;
    const auto radius = static_cast<double>(sphere.radius);
    const double depth = std::max(0.0, radius - nearest.distance);
    const Vector3d normal = -(placement.R_AB * nearest.normal);
    ShapeContact contact;
    contact.position = (sphere.centre.cast<double>() + (radius - 0.5 * depth) * normal).cast<float>();
    contact.normal = normal.cast<float>();
    contact.depth = static_cast<float>(depth);
    contact.volume = static_cast<float>(cap_volume(radius, depth));
    contact.sphere = a.order()[place];
    contacts->push_back(contact);
    return false;
  };
  return !for_overlapping(a, b, placement, scratch, found);
}

PenaltyWrench penalty_wrench(const SphereTree& a, const StaticShape& b, const Transform& X_AB,
                             const PenaltyOptions& options, SphereScratch& scratch) {
  const ShapePlacement placement(a, X_AB);
  PenaltyWrench sum;
  for_overlapping(a, b, placement, scratch,
                  [&](const PackedSphere& sphere, const StaticShape::Nearest& nearest, std::uint32_t) {
                    const double half = 0.5 * std::max(0.0, static_cast<double>(sphere.radius) - nearest.distance);
                    const Vector3d push = placement.R_AB * nearest.normal * half;
                    sum.force += push;
                    sum.torque += (sphere.centre.cast<double>() - options.p_AP).cross(push);
                    sum.energy += half * half;
                    ++sum.pairs;
                    return false;
                  });
  sum.force *= options.stiffness;
  sum.torque *= options.stiffness;
  sum.energy *= options.stiffness;
  return sum;
}

std::optional<ShapeDistance> distance(const SphereTree& a, const StaticShape& b, const Transform& X_AB,
                                      SphereScratch& scratch, double below) {
  const ShapePlacement placement(a, X_AB);
  std::optional<ShapeDistance> best;
  std::vector<SphereScratch::NodePair>& stack = scratch.pairs;
  stack.clear();
  stack.push_back({0, 0, a.root(), {}, -std::numeric_limits<float>::infinity()});
  while (!stack.empty()) {
    const SphereScratch::NodePair pair = stack.back();
    stack.pop_back();
    if (static_cast<double>(pair.bound) >= below) continue;
    const SphereTree::Node& node = a.nodes()[pair.a];
    const std::size_t before = stack.size();
    for (std::uint32_t k = 0; k < node.count; ++k) {
      const PackedSphere child = lane(a, pair.a, k);
      const auto radius = static_cast<double>(child.radius);
      const double reach = radius + (node.is_bottom() ? 0.0 : placement.slack);
      const auto nearest = b.nearest(placement.to_shape(child.centre), below + reach);
      if (!nearest) continue;
      if (node.is_bottom()) {
        below = nearest->distance - radius;
        best = ShapeDistance{below, a.order()[node.first + k]};
      } else {
        const auto bound = static_cast<float>(nearest->distance - reach);
        stack.push_back({node.first + k, 0, child, {}, std::nextafter(bound, -std::numeric_limits<float>::infinity())});
      }
    }
    // The nearest first.
    std::sort(stack.begin() + static_cast<std::ptrdiff_t>(before), stack.end(),
              [](const auto& x, const auto& y) { return x.bound > y.bound; });
  }
  return best;
}

}  // namespace prescene::collision
