// SPDX-License-Identifier: Apache-2.0
// What the vector and the scalar queries share: placing of spheres, slack, and what one pair of spheres gives.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "prescene/collision/spheres/sphere_queries.h"

namespace prescene::collision {

inline PackedSphere lane(const SphereTree& tree, std::uint32_t node, std::size_t k) {
  const float* lanes = tree.lanes(node);
  const std::size_t n = tree.branching();
  return {Vector3f(lanes[k], lanes[n + k], lanes[2 * n + k]), lanes[3 * n + k]};
}

inline float squared_length(float x, float y, float z) { return (x * x + y * y) + z * z; }

/// What all roundings of placed centres and of sums of distances may add up to, m. A coordinate comes from three
/// products and three sums of numbers up to the reach of B and the distance, a difference of two centres doubles that,
/// and squaring and comparing costs a few units in the last place of the sum of the radii: below 32 roundings in all.
/// The rotation itself is rounded, which scales lengths by up to two units.
inline float slack_of(const SphereTree& a, const SphereTree& b, const Transform& X_AB) {
  const auto reach = [](const SphereTree& tree) { return tree.root().centre.norm() + tree.root().radius; };
  const float distance = std::abs(X_AB.translation[0]) + std::abs(X_AB.translation[1]) + std::abs(X_AB.translation[2]);
  return 64.0F * std::numeric_limits<float>::epsilon() * (reach(a) + reach(b) + distance);
}

inline PackedSphere placed(const Transform& X_AB, const PackedSphere& sphere) {
  return {X_AB * sphere.centre, sphere.radius};
}

/// Whether bounding spheres may overlap; of the packing's spheres without slack: whether they do.
inline bool meet(const PackedSphere& a, const PackedSphere& b, float slack) {
  const float reach = (a.radius + slack) + b.radius;
  return squared_length(b.centre.x() - a.centre.x(), b.centre.y() - a.centre.y(), b.centre.z() - a.centre.z()) <=
         reach * reach;
}

/// Of spheres in A's frame; `pair` in places.
inline SphereContact make_contact(const SphereTree& a, const SphereTree& b, const PackedSphere& sphere_a,
                                  const PackedSphere& sphere_b, SpherePair places) {
  using Eigen::Vector3d;
  SphereContact contact;
  contact.pair = {a.order()[places.a], b.order()[places.b]};
  const auto radius_a = static_cast<double>(sphere_a.radius);
  const auto radius_b = static_cast<double>(sphere_b.radius);
  const Vector3d between = sphere_b.centre.cast<double>() - sphere_a.centre.cast<double>();
  const double d = between.norm();
  const double depth = std::max(0.0, radius_a + radius_b - d);
  const Vector3d normal =
      d > 0.0 ? Vector3d(between / d) : Vector3d(a.packing().anchors()[contact.pair.a].normal.cast<double>());
  contact.normal = normal.cast<float>();
  contact.position = (sphere_a.centre.cast<double>() + (radius_a - 0.5 * depth) * normal).cast<float>();
  contact.depth = static_cast<float>(depth);
  contact.volume = static_cast<float>(lens_volume(radius_a, radius_b, d));
  return contact;
}

inline bool is_pair_of(const SphereTree& a, const SphereTree& b, SpherePair pair) {
  return pair.a < a.packing().size() && pair.b < b.packing().size();
}

/// Distance of two spheres of the packings, in double precision of the placed centres.
inline SphereDistance distance_of(const SphereTree& a, const SphereTree& b, const Transform& X_AB, SpherePair pair) {
  const PackedSphere& sphere_a = a.packing().spheres()[pair.a];
  const PackedSphere sphere_b = placed(X_AB, b.packing().spheres()[pair.b]);
  const double apart = (sphere_a.centre.cast<double>() - sphere_b.centre.cast<double>()).norm();
  return {apart - static_cast<double>(sphere_a.radius) - static_cast<double>(sphere_b.radius), pair};
}

/// The smallest distance found so far, and what a distance must be below to matter.
struct NearestSpheres {
  std::optional<SphereDistance> found;
  double below = std::numeric_limits<double>::infinity();
  float limit = std::numeric_limits<float>::infinity();  ///< Not less than `below`.

  void lower_to(double distance) {
    below = distance;
    limit = static_cast<float>(below);
    if (static_cast<double>(limit) < below) limit = std::nextafter(limit, std::numeric_limits<float>::infinity());
  }
  void take(const SphereDistance& distance) {
    if (distance.distance >= below) return;
    found = distance;
    lower_to(distance.distance);
  }
};

}  // namespace prescene::collision
