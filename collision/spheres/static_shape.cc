// SPDX-License-Identifier: Apache-2.0
#include "prescene/collision/spheres/static_shape.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "mesh_holes.h"
#include "prescene/collision/point_queries.h"
#include "prescene/core/check.h"
#include "surface_descent.h"

namespace prescene::collision {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Nearest = StaticShape::Nearest;

Vector3d direction(const Vector3d& v, const Vector3d& otherwise) {
  const double length = v.norm();
  return length > 0.0 ? Vector3d(v / length) : otherwise;
}

Nearest nearest_of(const geometry::Sphere& sphere, const Vector3d& p) {
  return {p.norm() - sphere.radius, direction(p, Vector3d::UnitZ())};
}

Nearest nearest_of(const geometry::BoxShape& box, const Vector3d& p) {
  const Vector3d beyond = p.cwiseAbs() - 0.5 * box.size;
  const Vector3d sign = p.unaryExpr([](double x) { return x < 0.0 ? -1.0 : 1.0; });
  if (beyond.maxCoeff() <= 0.0) {
    Eigen::Index axis = 0;
    const double distance = beyond.maxCoeff(&axis);
    return {distance, sign[axis] * Vector3d::Unit(axis)};
  }
  const Vector3d out = beyond.cwiseMax(0.0);
  return {out.norm(), sign.cwiseProduct(out).normalized()};
}

// Shapes turned about z: solved in the half plane of (distance from the axis, z).
struct Nearest2 {
  double distance;
  Vector2d normal;
};

Nearest turned(const Nearest2& flat, const Vector3d& p) {
  const Vector3d radial = direction(Vector3d(p.x(), p.y(), 0.0), Vector3d::UnitX());
  return {flat.distance, flat.normal.x() * radial + flat.normal.y() * Vector3d::UnitZ()};
}

Nearest nearest_of(const geometry::Cylinder& cylinder, const Vector3d& p) {
  const Vector2d q(p.head<2>().norm(), p.z());
  const double up = q.y() < 0.0 ? -1.0 : 1.0;
  const Vector2d beyond(q.x() - cylinder.radius, std::abs(q.y()) - 0.5 * cylinder.length);
  if (beyond.maxCoeff() <= 0.0) {
    if (beyond.x() >= beyond.y()) return turned({beyond.x(), Vector2d(1.0, 0.0)}, p);
    return turned({beyond.y(), Vector2d(0.0, up)}, p);
  }
  const Vector2d out = beyond.cwiseMax(0.0);
  return turned({out.norm(), Vector2d(out.x(), up * out.y()).normalized()}, p);
}

Nearest nearest_of(const geometry::Capsule& capsule, const Vector3d& p) {
  const double half = 0.5 * capsule.length;
  const Vector3d from_axis = p - Vector3d(0.0, 0.0, std::clamp(p.z(), -half, half));
  return {from_axis.norm() - capsule.radius, direction(from_axis, Vector3d::UnitX())};
}

Nearest nearest_of(const geometry::Cone& cone, const Vector3d& p) {
  // The triangle of the axis, the base and the side; the axis is no surface.
  const Vector2d q(p.head<2>().norm(), p.z());
  const Vector2d tip(0.0, 0.5 * cone.length);
  const Vector2d rim(cone.radius, -0.5 * cone.length);
  const Vector2d side = tip - rim;
  const Vector2d side_normal = Vector2d(cone.length, cone.radius).normalized();
  const Vector2d on_base(std::min(q.x(), cone.radius), -0.5 * cone.length);
  const Vector2d on_side = rim + std::clamp(side.dot(q - rim) / side.squaredNorm(), 0.0, 1.0) * side;
  const bool inside = q.y() >= -0.5 * cone.length && side_normal.dot(q - rim) <= 0.0;
  const double to_base = (q - on_base).norm();
  const double to_side = (q - on_side).norm();
  const bool base = to_base <= to_side;
  const double distance = base ? to_base : to_side;
  if (inside) return turned({-distance, base ? Vector2d(0.0, -1.0) : side_normal}, p);
  if (distance == 0.0) return turned({0.0, base ? Vector2d(0.0, -1.0) : side_normal}, p);
  return turned({distance, (q - (base ? on_base : on_side)) / distance}, p);
}

std::optional<Nearest> if_below(const Nearest& nearest, double below) {
  if (nearest.distance < below) return nearest;
  return std::nullopt;
}

}  // namespace

core::Result<HalfSpace> HalfSpace::make(const Vector3d& normal, double offset) {
  const double length = normal.norm();
  if (!(length > 0.0) || !std::isfinite(length) || !std::isfinite(offset))
    return core::invalid_input(
        "half-space: its normal is zero or a number is not finite; give a direction and an offset");
  HalfSpace half_space;
  half_space.normal_ = normal / length;
  half_space.offset_ = offset;
  return half_space;
}

std::optional<Nearest> HalfSpace::nearest(const Vector3d& p_BQ, double below) const {
  return if_below({normal_.dot(p_BQ) - offset_, normal_}, below);
}

std::optional<double> HalfSpace::swept_sphere_contact(const Vector3d& from, const Vector3d& to, double radius) const {
  const double gap = normal_.dot(from) - offset_ - radius;
  const double gap_at_end = normal_.dot(to) - offset_ - radius;
  if (gap <= 0.0) return 0.0;
  if (gap_at_end > 0.0) return std::nullopt;
  return gap / (gap - gap_at_end);
}

core::Result<PrimitiveShape> PrimitiveShape::make(const geometry::Primitive& primitive) {
  const Vector3d lengths = std::visit(
      [](const auto& shape) -> Vector3d {
        if constexpr (requires { shape.size; }) {
          return shape.size;
        } else if constexpr (requires { shape.length; }) {
          return {shape.radius, shape.length, 1.0};
        } else {
          return {shape.radius, 1.0, 1.0};
        }
      },
      primitive);
  if (!lengths.allFinite() || !(lengths.minCoeff() > 0.0))
    return core::invalid_input("primitive: a length is not positive and finite; lengths are in m");
  return PrimitiveShape(primitive);
}

std::optional<Nearest> PrimitiveShape::nearest(const Vector3d& p_BQ, double below) const {
  return if_below(nearest(p_BQ), below);
}

Nearest PrimitiveShape::nearest(const Vector3d& p_BQ) const {
  return std::visit([&](const auto& shape) { return nearest_of(shape, p_BQ); }, primitive_);
}

std::optional<double> PrimitiveShape::swept_sphere_contact(const Vector3d& from, const Vector3d& to,
                                                           double radius) const {
  // All primitives are convex: the plane across the normal has the shape behind it, so that the sphere does not touch
  // before it touches that plane. As the distance is a convex function of the time, this is Newton's method from the
  // left. Where the sphere grazes, it halves the way that is left with each step.
  constexpr int kMostSteps = 100;
  const Vector3d move = to - from;
  const double rounding = 1e-15 * (from.norm() + to.norm() + radius);
  double t = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    const Nearest at = nearest(from + t * move);
    const double gap = at.distance - radius;
    if (gap <= (step == 0 ? 0.0 : rounding)) break;
    const double approach = -at.normal.dot(move);
    if (approach <= 0.0) return std::nullopt;
    const double next = t + gap / approach;
    if (next > 1.0) return std::nullopt;
    if (next <= t) break;
    t = next;
  }
  return t;
}

core::Result<TriangleSurface> TriangleSurface::make(std::shared_ptr<const TriangleTree> tree, SurfaceSide side) {
  PRESCENE_CHECK(tree != nullptr);
  const Mesh& mesh = tree->mesh();
  if (side == SurfaceSide::kSolid) {
    PRESCENE_RETURN_IF_ERROR(check_closed(mesh, open_edges(mesh), "take it as a surface with SurfaceSide::kBoth"));
  }
  return TriangleSurface(std::move(tree), side);
}

core::Result<TriangleSurface> TriangleSurface::make(std::shared_ptr<const Mesh> mesh, SurfaceSide side,
                                                    core::ThreadPool& pool) {
  return make(std::make_shared<const TriangleTree>(TriangleTree::build(std::move(mesh), {}, pool)), side);
}

TriangleSurface::TriangleSurface(std::shared_ptr<const TriangleTree> tree, SurfaceSide side)
    : tree_(std::move(tree)),
      rims_(std::make_shared<const std::vector<std::uint8_t>>(find_rims(tree_->mesh()))),
      side_(side) {}

bool TriangleSurface::is_flat_about(const Vector3d& place, const Vector3d& normal, double radius, double slack) const {
  return collision::is_flat_about(*tree_, *rims_, place, normal, radius, slack);
}

bool TriangleSurface::is_inside(const Vector3d& p_BQ) const {
  return side_ == SurfaceSide::kSolid && winding_number(*tree_, p_BQ) > 0;
}

std::optional<Nearest> TriangleSurface::nearest(const Vector3d& p_BQ, double below) const {
  const bool inside = is_inside(p_BQ);
  if (!inside && below <= 0.0) return std::nullopt;
  const auto found = inside ? nearest_point(*tree_, p_BQ) : nearest_point(*tree_, p_BQ, below);
  if (!found) return std::nullopt;
  // On the surface itself: the way that the triangle faces.
  const auto corners = tree_->mesh().corners(found->triangle);
  const Vector3d facing = (corners[1] - corners[0]).cast<double>().cross((corners[2] - corners[0]).cast<double>());
  const Vector3d out = inside ? Vector3d(found->point - p_BQ) : Vector3d(p_BQ - found->point);
  return if_below({inside ? -found->distance : found->distance, direction(out, direction(facing, Vector3d::UnitZ()))},
                  below);
}

std::optional<double> TriangleSurface::swept_sphere_contact(const Vector3d& from, const Vector3d& to,
                                                            double radius) const {
  if (is_inside(from)) return 0.0;
  const double t = first_contact(*tree_, SweptSphere(from, to, radius));
  return t <= 1.0 ? std::optional(t) : std::nullopt;
}

double TriangleSurface::reach_along(const Vector3d& direction, const Vector3d& centre, double radius) const {
  return std::min(collision::reach_along(*tree_, direction, centre, radius), direction.dot(centre) + radius);
}

bool TriangleSurface::is_within(const Vector3d& p_BQ, double below) const {
  if (below <= 0.0) return nearest(p_BQ, below).has_value();
  return collision::is_within(*tree_, p_BQ, below) || is_inside(p_BQ);
}

}  // namespace prescene::collision
