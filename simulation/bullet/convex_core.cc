// SPDX-License-Identifier: Apache-2.0
#include "convex_core.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "prescene/core/check.h"
#include "prescene/simulation/rules/contact_rules.h"

namespace prescene::simulation {
namespace {

constexpr int kCapPoints = 12;  // up to kFlatCap they miss the lowest point by less than 4e-5 of the radius

// std::hypot is too slow here.
double hypotenuse(double x, double y) { return std::sqrt(x * x + y * y); }

}  // namespace

ConvexCore::ConvexCore(Kind kind) : kind_(kind) {
  m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE;
  setMargin(0.0);
}

void ConvexCore::set_bounds(const Vector3d& low, const Vector3d& high) {
  box_center_ = 0.5 * (low + high);
  box_half_size_ = 0.5 * (high - low);
}

std::unique_ptr<ConvexCore> ConvexCore::from_primitive(const geometry::Primitive& primitive, double rounding) {
  struct Maker {
    double rounding;
    std::unique_ptr<ConvexCore> operator()(const geometry::Sphere& s) const {
      std::unique_ptr<ConvexCore> core(new ConvexCore(Kind::kPoint));
      core->radius_ = s.radius;
      core->set_bounds(Vector3d::Constant(-s.radius), Vector3d::Constant(s.radius));
      return core;
    }
    std::unique_ptr<ConvexCore> operator()(const geometry::BoxShape& b) const {
      std::unique_ptr<ConvexCore> core(new ConvexCore(Kind::kBox));
      core->radius_ = rounded_edge(rounding, 0.5 * b.size.minCoeff());
      core->half_ = 0.5 * b.size - Vector3d::Constant(core->radius_);
      core->set_bounds(-0.5 * b.size, 0.5 * b.size);
      return core;
    }
    std::unique_ptr<ConvexCore> operator()(const geometry::Cylinder& c) const {
      std::unique_ptr<ConvexCore> core(new ConvexCore(Kind::kCylinder));
      core->radius_ = rounded_edge(rounding, std::min(c.radius, 0.5 * c.length));
      const double z = 0.5 * c.length - core->radius_;
      core->half_ = {c.radius - core->radius_, z, -z};
      core->set_bounds({-c.radius, -c.radius, -0.5 * c.length}, {c.radius, c.radius, 0.5 * c.length});
      return core;
    }
    std::unique_ptr<ConvexCore> operator()(const geometry::Capsule& c) const {
      std::unique_ptr<ConvexCore> core(new ConvexCore(Kind::kSegment));
      core->radius_ = c.radius;
      core->half_ = {0.0, 0.0, 0.5 * c.length};
      const Vector3d corner(c.radius, c.radius, 0.5 * c.length + c.radius);
      core->set_bounds(-corner, corner);
      return core;
    }
    std::unique_ptr<ConvexCore> operator()(const geometry::Cone& c) const {
      std::unique_ptr<ConvexCore> core(new ConvexCore(Kind::kCone));
      // Radius of the largest ball inside bounds the rounding; moving base and side inwards by r gives a similar cone.
      const double slant = std::hypot(c.radius, c.length);
      const double inner = c.radius * c.length / (slant + c.radius);
      const double r = rounded_edge(rounding, inner);
      core->radius_ = r;
      const double bottom = -0.5 * c.length + r;
      const double top = 0.5 * c.length - r * slant / c.radius;
      core->half_ = {(top - bottom) * c.radius / c.length, top, bottom};
      core->center_ = {0.0, 0.0, 0.75 * bottom + 0.25 * top};
      core->set_bounds({-c.radius, -c.radius, -0.5 * c.length}, {c.radius, c.radius, 0.5 * c.length});
      return core;
    }
  };
  return std::visit(Maker{rounding}, primitive);
}

std::unique_ptr<ConvexCore> ConvexCore::from_polytope(const ConvexPolytope& polytope, double rounding) {
  std::unique_ptr<ConvexCore> core(new ConvexCore(Kind::kPolytope));
  core->radius_ = rounded_edge(rounding, polytope.inner_radius());
  if (std::optional<ConvexPolytope> smaller = inset(polytope, core->radius_)) {
    core->polytope_ = std::move(*smaller);
  } else {
    core->polytope_ = polytope;
    core->radius_ = 0.0;
  }
  core->center_ = core->polytope_.vertex_mean();
  Eigen::AlignedBox3d box;
  for (const Vector3d& v : polytope.vertices) box.extend(v);
  core->set_bounds(box.min(), box.max());
  return core;
}

std::unique_ptr<ConvexCore> ConvexCore::triangle() {
  return std::unique_ptr<ConvexCore>(new ConvexCore(Kind::kTriangle));
}

void ConvexCore::set_triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  PRESCENE_DCHECK(kind_ == Kind::kTriangle);
  triangle_ = {a, b, c};
  center_ = (a + b + c) / 3.0;
}

Vector3d ConvexCore::support(const Vector3d& d) const {
  switch (kind_) {
    case Kind::kPoint:
      return Vector3d::Zero();
    case Kind::kSegment:
      return {0.0, 0.0, d.z() >= 0.0 ? half_.z() : -half_.z()};
    case Kind::kBox:
      return {d.x() >= 0.0 ? half_.x() : -half_.x(), d.y() >= 0.0 ? half_.y() : -half_.y(),
              d.z() >= 0.0 ? half_.z() : -half_.z()};
    case Kind::kPolytope: {
      const std::vector<Vector3d>& vertices = polytope_.vertices;
      std::size_t best = 0;
      double height = vertices[0].dot(d);
      for (std::size_t i = 1; i < vertices.size(); ++i) {
        const double h = vertices[i].dot(d);
        if (h > height) {
          height = h;
          best = i;
        }
      }
      return vertices[best];
    }
    case Kind::kCylinder: {
      const double s = hypotenuse(d.x(), d.y());
      const double z = d.z() >= 0.0 ? half_.y() : half_.z();
      if (s == 0.0) return {half_.x(), 0.0, z};
      return {half_.x() * d.x() / s, half_.x() * d.y() / s, z};
    }
    case Kind::kCone: {
      const double s = hypotenuse(d.x(), d.y());
      const double tip = d.z() * half_.y();
      const double rim = s * half_.x() + d.z() * half_.z();
      if (tip > rim) return {0.0, 0.0, half_.y()};
      if (s == 0.0) return {half_.x(), 0.0, half_.z()};
      return {half_.x() * d.x() / s, half_.x() * d.y() / s, half_.z()};
    }
    case Kind::kTriangle: {
      const double a = triangle_[0].dot(d);
      const double b = triangle_[1].dot(d);
      const double c = triangle_[2].dot(d);
      if (a >= b && a >= c) return triangle_[0];
      return b >= c ? triangle_[1] : triangle_[2];
    }
  }
  return Vector3d::Zero();
}

void ConvexCore::cap(double z, const Vector3d& direction, Feature& feature) const {
  // One point lies where the rim is lowest in `direction`, so that a tilted rim touches where it should. A flat cap
  // keeps its points: where it is lowest would be noise, and contacts that jump about never come to rest.
  const bool tilted = hypotenuse(direction.x(), direction.y()) > kFlatCap;
  const double start = tilted ? std::atan2(direction.y(), direction.x()) : 0.0;
  const double turn = (z > 0.0 ? 2.0 : -2.0) * std::numbers::pi / kCapPoints;
  for (int i = 0; i < kCapPoints; ++i) {
    const double angle = start + i * turn;
    feature.add({half_.x() * std::cos(angle), half_.x() * std::sin(angle), z});
  }
  feature.normal = {0.0, 0.0, z > 0.0 ? 1.0 : -1.0};
}

void ConvexCore::facing(const Vector3d& d, Feature& feature) const {
  feature.clear();
  switch (kind_) {
    case Kind::kPoint:
      feature.add(Vector3d::Zero());
      break;
    case Kind::kSegment:
      feature.add({0.0, 0.0, -half_.z()});
      feature.add({0.0, 0.0, half_.z()});
      break;
    case Kind::kBox: {
      int axis = 0;
      d.cwiseAbs().maxCoeff(&axis);
      const double sign = d[axis] >= 0.0 ? 1.0 : -1.0;
      const int u = (axis + 1) % 3;
      const int v = (axis + 2) % 3;
      feature.normal = Vector3d::Zero();
      feature.normal[axis] = sign;
      for (int i = 0; i < 4; ++i) {
        // Around +axis: (-,-) (+,-) (+,+) (-,+); the other way round for -axis.
        const int k = sign > 0.0 ? i : 3 - i;
        Vector3d p;
        p[axis] = sign * half_[axis];
        p[u] = k == 1 || k == 2 ? half_[u] : -half_[u];
        p[v] = k >= 2 ? half_[v] : -half_[v];
        feature.add(p);
      }
      break;
    }
    case Kind::kPolytope: {
      const ConvexPolytope::Face* best = &polytope_.faces[0];
      double alignment = best->normal.dot(d);
      for (const ConvexPolytope::Face& face : polytope_.faces) {
        const double a = face.normal.dot(d);
        if (a > alignment) {
          alignment = a;
          best = &face;
        }
      }
      feature.normal = best->normal;
      const std::size_t size = best->loop.size();
      const std::size_t step = (size + Feature::kMaxCorners - 1) / Feature::kMaxCorners;
      for (std::size_t i = 0; i < size; i += step) feature.add(polytope_.vertices[best->loop[i]]);
      break;
    }
    case Kind::kCylinder: {
      const double s = hypotenuse(d.x(), d.y());
      if (std::abs(d.z()) > s) {
        cap(d.z() > 0.0 ? half_.y() : half_.z(), d, feature);
      } else {
        const double x = half_.x() * d.x() / s;
        const double y = half_.x() * d.y() / s;
        feature.add({x, y, half_.z()});
        feature.add({x, y, half_.y()});
      }
      break;
    }
    case Kind::kCone: {
      const double s = hypotenuse(d.x(), d.y());
      const double height = half_.y() - half_.z();
      const double slant = std::hypot(half_.x(), height);
      const double side = (s * height + d.z() * half_.x()) / slant;  // alignment with the side's normal
      if (-d.z() >= side) {
        cap(half_.z(), d, feature);
        feature.normal = {0.0, 0.0, -1.0};
      } else if (s == 0.0) {
        feature.add({0.0, 0.0, half_.y()});
      } else {
        feature.add({half_.x() * d.x() / s, half_.x() * d.y() / s, half_.z()});
        feature.add({0.0, 0.0, half_.y()});
      }
      break;
    }
    case Kind::kTriangle: {
      const Vector3d n = (triangle_[1] - triangle_[0]).cross(triangle_[2] - triangle_[0]).normalized();
      const bool front = n.dot(d) >= 0.0;
      feature.normal = front ? n : Vector3d(-n);
      feature.add(triangle_[0]);
      feature.add(triangle_[front ? 1 : 2]);
      feature.add(triangle_[front ? 2 : 1]);
      break;
    }
  }
}

btVector3 ConvexCore::localGetSupportingVertexWithoutMargin(const btVector3& direction) const {
  return to_bullet(support(from_bullet(direction)));
}

void ConvexCore::batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions, btVector3* vertices,
                                                                   int count) const {
  for (int i = 0; i < count; ++i) vertices[i] = localGetSupportingVertexWithoutMargin(directions[i]);
}

void ConvexCore::calculateLocalInertia(btScalar, btVector3& inertia) const {
  // Inertia comes with the object's model, never from its contact shape.
  inertia.setZero();
}

void ConvexCore::getAabb(const btTransform& transform, btVector3& low, btVector3& high) const {
  const btVector3 center = transform * to_bullet(box_center_);
  const btVector3 half = transform.getBasis().absolute() * to_bullet(box_half_size_);
  low = center - half;
  high = center + half;
}

}  // namespace prescene::simulation
