// SPDX-License-Identifier: Apache-2.0
#include "tests/support/hollow_meshes.h"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "prescene/geometry/primitives.h"

namespace prescene::tests {
namespace {

using geometry::Quaterniond;
using geometry::Vector3d;

constexpr double kPi = std::numbers::pi;

Quaterniond about(const Vector3d& axis, double angle) { return Quaterniond(Eigen::AngleAxisd(angle, axis)); }

geometry::TriangleMesh moved(const geometry::TriangleMesh& mesh, const Vector3d& by,
                             const Quaterniond& rotation = Quaterniond::Identity()) {
  return geometry::transformed(mesh, geometry::Pose{rotation, by});
}

}  // namespace

geometry::TriangleMesh cup(double radius, double height, double wall, int segments) {
  return geometry::make_lathe(
      {{0.0, 0.0}, {radius, 0.0}, {radius, height}, {radius - wall, height}, {radius - wall, wall}, {0.0, wall}},
      segments);
}

geometry::TriangleMesh bowl(double radius, double depth, double wall, int segments) {
  std::vector<Eigen::Vector2d> profile;
  constexpr int kSteps = 14;
  const double last = std::acos(1.0 - depth / radius);
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = last * i / kSteps;
    profile.emplace_back(i == 0 ? 0.0 : radius * std::sin(angle), radius - radius * std::cos(angle));
  }
  for (int i = kSteps; i >= 0; --i) {
    const double angle = last * i / kSteps;
    profile.emplace_back(i == 0 ? 0.0 : (radius - wall) * std::sin(angle), radius - (radius - wall) * std::cos(angle));
  }
  return geometry::make_lathe(profile, segments);
}

geometry::TriangleMesh arc(double radius, double tube, double from, double to, int along, int around) {
  geometry::TriangleMesh mesh;
  const bool whole = to - from > 2.0 * kPi - 1e-9;
  const int rings = whole ? along : along + 1;
  for (int i = 0; i < rings; ++i) {
    const double a = from + (to - from) * i / along;
    for (int k = 0; k < around; ++k) {
      const double b = 2.0 * kPi * k / around;
      const double r = radius + tube * std::cos(b);
      mesh.vertices.emplace_back(r * std::cos(a), tube * std::sin(b), r * std::sin(a));
    }
  }
  const auto at = [&](int i, int k) { return static_cast<std::uint32_t>(i % rings * around + k % around); };
  for (int i = 0; i < along; ++i) {
    for (int k = 0; k < around; ++k) {
      mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  if (!whole) {
    for (int k = 1; k + 1 < around; ++k) {
      mesh.triangles.push_back({at(0, 0), at(0, k), at(0, k + 1)});
      mesh.triangles.push_back({at(along, 0), at(along, k + 1), at(along, k)});
    }
  }
  double volume = 0.0;
  for (const auto& t : mesh.triangles)
    volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
  if (volume < 0.0)
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

geometry::TriangleMesh mug() {
  return geometry::joined(cup(0.04, 0.09, 0.003),
                          moved(arc(0.025, 0.005, -0.5 * kPi, 0.5 * kPi), {0.0385, 0.0, 0.045}));
}

geometry::TriangleMesh spoon() {
  return geometry::joined(moved(bowl(0.02, 0.012, 0.0015, 24), {0.016, 0.0, 0.0}, about(Vector3d::UnitY(), 0.5 * kPi)),
                          moved(geometry::make_mesh(geometry::Capsule{0.0025, 0.12}, 16), {0.0175, 0.0, 0.076}));
}

}  // namespace prescene::tests
