// SPDX-License-Identifier: Apache-2.0
#include "tests/support/generators.h"

#include <numbers>
#include <ostream>

namespace prescene::tests {

using geometry::Pose;
using geometry::Quaterniond;
using geometry::TriangleMesh;
using geometry::Vector3d;
using geometry::Vector6d;

namespace {

constexpr int kSteps = 1000000;

// In [-1, 1]; shrinks towards 0.
rc::Gen<double> fractions() {
  return rc::gen::map(rc::gen::inRange(-kSteps, kSteps + 1), [](int i) { return static_cast<double>(i) / kSteps; });
}

Vector3d vector_of(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

rc::Gen<double> numbers(double low, double high) {
  return rc::gen::map(rc::gen::inRange(0, kSteps + 1),
                      [=](int i) { return low + (high - low) * static_cast<double>(i) / kSteps; });
}

rc::Gen<Vector3d> vectors(double reach) {
  return rc::gen::map(rc::gen::container<std::vector<double>>(3, fractions()),
                      [=](const std::vector<double>& v) { return Vector3d(reach * vector_of(v)); });
}

rc::Gen<Vector3d> directions() {
  return rc::gen::map(vectors(1.0),
                      [](const Vector3d& v) { return v.isZero() ? Vector3d(Vector3d::UnitZ()) : v.normalized(); });
}

rc::Gen<Quaterniond> rotations() {
  const auto angles = rc::gen::weightedOneOf<double>({{6, numbers(0.0, std::numbers::pi)},
                                                      {1, numbers(0.0, 1e-7)},
                                                      {1, rc::gen::just(std::numbers::pi)},
                                                      {1, rc::gen::just(0.5 * std::numbers::pi)}});
  return rc::gen::apply([](double angle, const Vector3d& axis) { return geometry::exp_rotation(angle * axis); }, angles,
                        directions());
}

rc::Gen<Pose> poses(double reach) {
  return rc::gen::apply(
      [](const Quaterniond& q, const Vector3d& p) {
        return Pose{q, p};
      },
      rotations(), vectors(reach));
}

rc::Gen<Vector6d> pose_errors() {
  return rc::gen::apply(
      [](double angle, const Vector3d& axis, const Vector3d& p) {
        Vector6d d;
        d << angle * axis, p;
        return d;
      },
      numbers(0.0, 3.1), directions(), vectors());
}

rc::Gen<geometry::Primitive> primitives() {
  return rc::gen::apply(
      [](int kind, double a, double b, double c) -> geometry::Primitive {
        switch (kind) {
          case 0:
            return geometry::Sphere{a};
          case 1:
            return geometry::BoxShape{{a, b, c}};
          case 2:
            return geometry::Cylinder{a, b};
          case 3:
            return geometry::Capsule{a, b};
          default:
            return geometry::Cone{a, b};
        }
      },
      rc::gen::inRange(0, 5), numbers(0.01, 1.0), numbers(0.01, 1.0), numbers(0.01, 1.0));
}

rc::Gen<TriangleMesh> closed_meshes() {
  const auto bins = rc::gen::apply(
      [](double x, double y, double z) {
        return geometry::make_open_bin({x, y, z}, 0.07 * std::min({x, y, z}));
      },
      numbers(0.05, 1.0), numbers(0.05, 1.0), numbers(0.05, 1.0));
  const auto cartons =
      rc::gen::apply([](double x, double y, double z) { return geometry::make_gable_carton(x, y, z, 1.3 * z); },
                     numbers(0.05, 1.0), numbers(0.05, 1.0), numbers(0.05, 1.0));
  const auto lathes = rc::gen::apply(
      [](const std::vector<double>& radii, int segments) {
        std::vector<Eigen::Vector2d> profile;
        for (const double radius : radii) profile.emplace_back(radius, 0.13 * static_cast<double>(profile.size()));
        return geometry::make_lathe(profile, segments);
      },
      rc::gen::container<std::vector<double>>(4, numbers(0.02, 0.5)), rc::gen::inRange(3, 24));
  const auto bodies = rc::gen::map(
      primitives(), [](const geometry::Primitive& primitive) { return geometry::make_mesh(primitive, 12); });
  return rc::gen::apply([](const TriangleMesh& mesh, const Pose& X) { return geometry::transformed(mesh, X); },
                        rc::gen::oneOf(bodies, bins, cartons, lathes), poses());
}

}  // namespace prescene::tests

namespace prescene::geometry {

void showValue(const Pose& X, std::ostream& out) { out << to_string(X); }

void showValue(const Primitive& primitive, std::ostream& out) {
  struct Shower {
    std::ostream& out;
    void operator()(const Sphere& s) const { out << "sphere r=" << s.radius; }
    void operator()(const BoxShape& b) const { out << "box " << b.size.transpose(); }
    void operator()(const Cylinder& c) const { out << "cylinder r=" << c.radius << " l=" << c.length; }
    void operator()(const Capsule& c) const { out << "capsule r=" << c.radius << " l=" << c.length; }
    void operator()(const Cone& c) const { out << "cone r=" << c.radius << " l=" << c.length; }
  };
  std::visit(Shower{out}, primitive);
}

void showValue(const TriangleMesh& mesh, std::ostream& out) {
  out << mesh.vertices.size() << " vertices, " << mesh.triangles.size() << " triangles";
  constexpr std::size_t kFew = 32;
  if (mesh.vertices.size() > kFew) return;
  for (const Vector3d& p : mesh.vertices) out << " (" << p.transpose() << ")";
}

}  // namespace prescene::geometry
