// SPDX-License-Identifier: Apache-2.0
// A part of a surface and the sphere that touches it there, placed in the frame that contacts are found in.
#pragma once

#include <algorithm>
#include <optional>

#include "contact_finder.h"
#include "prescene/collision/spheres/surface_spheres.h"
#include "prescene/simulation/rules/sphere_rules.h"

namespace prescene::simulation {

inline Vector3d widened(const collision::Vector3f& v) { return v.cast<double>(); }

/// A patch in a frame F.
struct PlacedPatch {
  PlacedPatch(const collision::SurfacePatch& given, const Frame& X_FB)
      : patch(&given),
        X(&X_FB),
        centre(X_FB * widened(given.centre)),
        point(X_FB * widened(given.point)),
        normal(X_FB.R * widened(given.normal)),
        radius(static_cast<double>(given.radius)),
        reach(static_cast<double>(given.reach)) {}

  bool is_edge() const { return patch->is_edge(); }
  /// The lowest point of the sphere against a normal of the other body.
  Vector3d lowest(const Vector3d& other_normal) const { return centre - radius * other_normal; }
  /// Whether the surface about the point comes as far as there; edges stand for themselves.
  bool stands_for(const Vector3d& p) const { return is_edge() || (p - point).squaredNorm() <= reach * reach; }

  struct Height {
    double gap;       // distance from the patch, negative behind it
    Vector3d normal;  // of the patch below, F
  };
  /// Of a point over the patch; nothing beside it.
  std::optional<Height> height_of(const Vector3d& p) const {
    const Vector3d to_F = p - point;
    const double up = normal.dot(to_F), over = to_F.squaredNorm() - up * up;
    if (over > reach * reach) return std::nullopt;
    const Vector3d to = X->R.transpose() * to_F;
    const Height height = bent_height(to, up);
    const double depth = std::max(0.0, -height.gap);
    if (ends_before(to, depth)) return std::nullopt;
    const double shallow = std::max(0.0, 1.0 - depth / (kShallow * reach));
    const bool in_sphere = (p - centre).squaredNorm() <= radius * radius;
    if (!in_sphere && over > reach * reach * shallow) return std::nullopt;
    return height;
  }

  /// Of the patch, or its continuation, below a place.
  Vector3d normal_at(const Vector3d& p) const {
    const Vector3d to_F = p - point;
    return bent_height(X->R.transpose() * to_F, normal.dot(to_F)).normal;
  }

  /// Of a place given from the patch's point in the body's frame, `up` over its tangent plane.
  Height bent_height(const Vector3d& to, double up) const {
    if (patch->bend[0] == 0.0F && patch->bend[1] == 0.0F && patch->bend[2] == 0.0F) return {up, normal};
    const Vector3d tangent = widened(patch->tangent), bitangent = widened(patch->bitangent);
    const double u = tangent.dot(to), v = bitangent.dot(to);
    const auto b0 = static_cast<double>(patch->bend[0]), b1 = static_cast<double>(patch->bend[1]),
               b2 = static_cast<double>(patch->bend[2]);
    const double z = 0.5 * (b0 * u * u + b1 * u * v + b2 * v * v);
    const Vector3d slope = (b0 * u + 0.5 * b1 * v) * tangent + (0.5 * b1 * u + b2 * v) * bitangent;
    const Vector3d tilted = widened(patch->normal) - slope;
    const double length = tilted.norm();
    return {(up - z) / length, X->R * (tilted / length)};
  }

  /// Whether a sharp edge ends the patch before a place, given from its point in the body's frame. Places below the
  /// patch belong to it as far as they are deeper below what is beyond the edge.
  bool ends_before(const Vector3d& to, double depth) const {
    for (const collision::SurfacePatch::Limit& limit : patch->limits)
      if (limit.out.squaredNorm() > 0.0F &&
          widened(limit.out).dot(to) > static_cast<double>(limit.distance) + kPatchRoom - depth)
        return true;
    return false;
  }

  const collision::SurfacePatch* patch;
  const Frame* X;
  Vector3d centre, point, normal;
  double radius, reach;
};

/// Adds what turning does to a gap within a step of `dt`: `acceleration` is that towards the middle of the body, along
/// the contact's normal. Without it, the places of a rolling thing that come down next would brake it.
inline void turn(ContactPoint& contact, double acceleration, double dt) {
  if (contact.gap < -kRollingOverlap || acceleration <= 0.0) return;
  contact.turning = dt * acceleration;
  contact.gap += 0.5 * dt * contact.turning;
}

}  // namespace prescene::simulation
