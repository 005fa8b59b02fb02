// SPDX-License-Identifier: Apache-2.0
#include "fine_shapes.h"

#include <cmath>

#include "prescene/core/check.h"
#include "prescene/geometry/primitives.h"

namespace prescene::tests {
namespace {

using geometry::TriangleMesh;
using geometry::Vector3d;
using Profile = std::vector<Eigen::Vector2d>;

/// A profile with points added along its edges, none further than `longest` from the next.
Profile refined(const Profile& corners, double longest) {
  Profile result = {corners.front()};
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const Eigen::Vector2d from = corners[i - 1];
    const int parts = std::max(1, static_cast<int>(std::ceil((corners[i] - from).norm() / longest)));
    for (int k = 1; k <= parts; ++k) result.push_back(from + (corners[i] - from) * k / parts);
  }
  return result;
}

Profile vase() {
  Profile profile = {{0.0, 0.0}};
  for (int i = 0; i <= 50; ++i) profile.emplace_back(0.035 + 0.010 * std::sin(0.06 * i), 0.004 * i);
  profile.emplace_back(0.0, 0.2);
  return profile;
}

/// Rounder on one side than on the other, so that every turn shows.
TriangleMesh bent(TriangleMesh mesh) {
  for (Vector3d& p : mesh.vertices) p.x() += 1.5 * p.z() * p.z() + 0.1 * std::abs(p.y()) * p.z();
  return mesh;
}

TriangleMesh stone() {
  TriangleMesh mesh = geometry::make_mesh(geometry::Sphere{1.0}, 102);
  for (Vector3d& p : mesh.vertices) {
    const double bumps = 1.0 + 0.08 * std::sin(3.0 * p.x() + 1.0) * std::sin(4.0 * p.y()) + 0.1 * std::sin(2.5 * p.z());
    p = bumps * p.cwiseProduct(Vector3d(0.05, 0.04, 0.035));
  }
  return mesh;
}

std::vector<FineShape> make_fine_shapes() {
  const Profile cup = {{0.0, 0.0}, {0.030, 0.0}, {0.042, 0.09}, {0.039, 0.09}, {0.028, 0.004}, {0.0, 0.004}};
  const Profile bottle = {{0.0, 0.0},    {0.036, 0.0},   {0.038, 0.13}, {0.030, 0.16},
                          {0.014, 0.20}, {0.0135, 0.25}, {0.0, 0.26}};
  std::vector<FineShape> shapes;
  const auto add = [&](const char* name, const TriangleMesh& mesh) {
    auto levels = rendering::LevelsOfDetail::make(mesh, {});
    PRESCENE_CHECK(levels.ok());
    shapes.push_back({name, mesh, *std::move(levels)});
  };
  add("vase", geometry::make_lathe(vase(), 100));
  add("cup", geometry::make_lathe(refined(cup, 0.0045), 100));
  add("bottle", bent(geometry::make_lathe(refined(bottle, 0.006), 100)));
  add("stone", stone());
  return shapes;
}

}  // namespace

const std::vector<FineShape>& fine_shapes() {
  static const std::vector<FineShape> kShapes = make_fine_shapes();
  return kShapes;
}

}  // namespace prescene::tests
