// SPDX-License-Identifier: Apache-2.0
// ConvexCore: where it is nearest to a point.
#include <algorithm>
#include <cmath>
#include <limits>

#include "convex_core.h"
#include "prescene/core/check.h"

namespace prescene::simulation {
namespace {

using Eigen::Vector2d;
using Nearest = ConvexCore::Nearest;

Nearest towards(const Vector3d& from_core, const Vector3d& otherwise) {
  const double distance = from_core.norm();
  return {distance, distance > 0.0 ? Vector3d(from_core / distance) : otherwise, false};
}

/// Of shapes turned about z: from the half plane of (distance from the axis, z).
Nearest turned(double distance, const Vector2d& normal, bool flat, const Vector3d& p) {
  const double across = std::sqrt(p.x() * p.x() + p.y() * p.y());
  const Vector3d radial = across > 0.0 ? Vector3d(p.x() / across, p.y() / across, 0.0) : Vector3d::UnitX();
  return {distance, normal.x() * radial + normal.y() * Vector3d::UnitZ(), flat};
}

Nearest nearest_of_box(const Vector3d& half, const Vector3d& p) {
  const Vector3d beyond = p.cwiseAbs() - half;
  const Vector3d sign(p.x() < 0.0 ? -1.0 : 1.0, p.y() < 0.0 ? -1.0 : 1.0, p.z() < 0.0 ? -1.0 : 1.0);
  int axis = 0;
  const double most = beyond.maxCoeff(&axis);
  const int outside = (beyond.x() > 0.0 ? 1 : 0) + (beyond.y() > 0.0 ? 1 : 0) + (beyond.z() > 0.0 ? 1 : 0);
  if (outside <= 1) return {most, sign[axis] * Vector3d::Unit(axis), true};
  return towards(sign.cwiseProduct(beyond.cwiseMax(0.0)), Vector3d::UnitZ());
}

/// half = (radius of the rim, z of the top, z of the bottom).
Nearest nearest_of_cylinder(const Vector3d& half, const Vector3d& p) {
  const double across = std::sqrt(p.x() * p.x() + p.y() * p.y());
  const double middle = 0.5 * (half.y() + half.z());
  const double up = p.z() < middle ? -1.0 : 1.0;
  const Vector2d beyond(across - half.x(), std::abs(p.z() - middle) - 0.5 * (half.y() - half.z()));
  if (beyond.x() > 0.0 && beyond.y() > 0.0) {
    const double distance = beyond.norm();
    return turned(distance, Vector2d(beyond.x(), up * beyond.y()) / distance, false, p);
  }
  if (beyond.x() >= beyond.y()) return turned(beyond.x(), {1.0, 0.0}, false, p);
  return turned(beyond.y(), {0.0, up}, true, p);
}

Nearest nearest_of_cone(const Vector3d& half, const Vector3d& p) {
  const Vector2d q(std::sqrt(p.x() * p.x() + p.y() * p.y()), p.z());
  const Vector2d tip(0.0, half.y());
  const Vector2d rim(half.x(), half.z());
  const Vector2d side = tip - rim;
  const Vector2d side_normal = Vector2d(side.y(), -side.x()).normalized();
  const double above_side = side_normal.dot(q - rim);
  const double below_base = half.z() - q.y();
  if (above_side <= 0.0 && below_base <= 0.0) {
    if (above_side >= below_base) return turned(above_side, side_normal, false, p);
    return turned(below_base, {0.0, -1.0}, true, p);
  }
  if (below_base > 0.0 && q.x() <= half.x()) return turned(below_base, {0.0, -1.0}, true, p);
  const double along = std::clamp(side.dot(q - rim) / side.squaredNorm(), 0.0, 1.0);
  const Vector2d from = q - (rim + along * side);
  const double distance = from.norm();
  return turned(distance, distance > 0.0 ? Vector2d(from / distance) : side_normal, false, p);
}

}  // namespace

template <class FaceAt>
Nearest ConvexCore::nearest_of_polytope(const Vector3d& p, double limit, std::size_t count,
                                        const FaceAt& face_at) const {
  const ConvexPolytope::Face* highest = &face_at(0);
  double most = highest->normal.dot(p) - highest->offset;
  for (std::size_t i = 1; i < count; ++i) {
    const ConvexPolytope::Face& face = face_at(i);
    const double height = face.normal.dot(p) - face.offset;
    if (height <= most) continue;
    most = height;
    highest = &face;
  }
  if (most <= 0.0 || most > limit) return {most, highest->normal, true};
  Vector3d best = Vector3d::Zero();
  double least = std::numeric_limits<double>::infinity();
  // The face that sees the point from highest up is most often the one.
  const auto look_at = [&](const ConvexPolytope::Face& face) {
    bool above = true;
    for (std::size_t i = 0; i < face.loop.size(); ++i) {
      const Vector3d& from = polytope_.vertices[face.loop[i]];
      const Vector3d along = polytope_.vertices[face.loop[(i + 1) % face.loop.size()]] - from;
      const Vector3d to = p - from;
      if (face.normal.dot(along.cross(to)) >= 0.0) continue;
      above = false;
      const double share = std::clamp(along.dot(to) / along.squaredNorm(), 0.0, 1.0);
      const Vector3d away = to - share * along;
      if (away.squaredNorm() >= least) continue;
      least = away.squaredNorm();
      best = away;
    }
    return above;
  };
  if (look_at(*highest)) return {most, highest->normal, true};
  for (std::size_t i = 0; i < count; ++i) {
    const ConvexPolytope::Face& face = face_at(i);
    if (&face == highest) continue;
    const double height = face.normal.dot(p) - face.offset;
    if (height <= 0.0) continue;
    if (look_at(face)) return {height, face.normal, true};
  }
  return towards(best, highest->normal);
}

void ConvexCore::faces_about(const Vector3d& center, double ball, const std::vector<std::uint32_t>& given,
                             std::vector<std::uint32_t>& faces) const {
  const auto height = [&](std::uint32_t index) {
    const ConvexPolytope::Face& face = polytope_.faces[index];
    return face.normal.dot(center) - face.offset;
  };
  double most = -std::numeric_limits<double>::infinity();
  for (const std::uint32_t index : given) most = std::max(most, height(index));
  constexpr double kSlack = 1e-9;  // m: more than rounding takes away
  const double least = std::min(most - 2.0 * ball, -ball) - kSlack;
  faces.clear();
  for (const std::uint32_t index : given)
    if (height(index) >= least) faces.push_back(index);
}

Nearest ConvexCore::nearest(const Vector3d& p, const std::vector<std::uint32_t>& faces, double limit) const {
  PRESCENE_DCHECK(kind_ == Kind::kPolytope && !faces.empty());
  return nearest_of_polytope(p, limit, faces.size(),
                             [&](std::size_t i) -> const ConvexPolytope::Face& { return polytope_.faces[faces[i]]; });
}

Nearest ConvexCore::nearest(const Vector3d& p) const {
  switch (kind_) {
    case Kind::kPoint:
      return towards(p, Vector3d::UnitZ());
    case Kind::kSegment:
      return towards({p.x(), p.y(), p.z() - std::clamp(p.z(), -half_.z(), half_.z())}, Vector3d::UnitX());
    case Kind::kBox:
      return nearest_of_box(half_, p);
    case Kind::kPolytope:
      return nearest_of_polytope(p, std::numeric_limits<double>::infinity(), polytope_.faces.size(),
                                 [&](std::size_t i) -> const ConvexPolytope::Face& { return polytope_.faces[i]; });
    case Kind::kCylinder:
      return nearest_of_cylinder(half_, p);
    case Kind::kCone:
      return nearest_of_cone(half_, p);
    case Kind::kTriangle:
      break;
  }
  PRESCENE_CHECK_MSG(false, "nearest() of a triangle");
}

}  // namespace prescene::simulation
