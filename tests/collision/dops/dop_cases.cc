// SPDX-License-Identifier: Apache-2.0
#include "dop_cases.h"

#include <Eigen/Geometry>
#include <cmath>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/random.h"
#include "tests/support/brute_force.h"
#include "tests/support/collision_meshes.h"

namespace prescene::collision {
namespace {

using core::RandomStream;

constexpr int kPoses = 24;

std::shared_ptr<const Mesh> mesh_of(std::vector<Vector3f> vertices, std::vector<TriangleIndices> triangles,
                                    const std::string& name) {
  auto made = Mesh::make(std::move(vertices), std::move(triangles), name);
  PRESCENE_CHECK(made.ok());
  return *made;
}

// Triangles of all sizes; some points, some segments, some twice.
std::shared_ptr<const Mesh> ragged(int count, std::uint64_t seed) {
  RandomStream random(seed, core::Purpose::kTest);
  std::vector<Vector3f> vertices;
  std::vector<TriangleIndices> triangles;
  const auto point = [&](double size) -> Vector3f {
    const double z = random.uniform(-size, size), y = random.uniform(-size, size), x = random.uniform(-size, size);
    return Eigen::Vector3d(x, y, z).cast<float>();
  };
  for (int i = 0; i < count; ++i) {
    const Vector3f place = point(1.0);
    const double size = std::pow(10.0, random.uniform(-3.0, -0.5));
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (int corner = 0; corner < 3; ++corner) vertices.push_back(place + point(size));
    if (i % 7 == 0) vertices.back() = vertices[first];
    if (i % 11 == 0) vertices[first + 1] = vertices[first];
    triangles.push_back({first, first + 1, first + 2});
    if (i % 13 == 0) triangles.push_back(triangles.back());
  }
  return mesh_of(std::move(vertices), std::move(triangles), "ragged");
}

std::shared_ptr<const Mesh> moved(const Mesh& mesh, float scale, const Vector3f& shift) {
  std::vector<Vector3f> vertices = mesh.vertices();
  for (Vector3f& p : vertices) p = p * scale + shift;
  return mesh_of(std::move(vertices), mesh.triangles(), mesh.name() + " moved");
}

Eigen::Vector3d middle(const Mesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Vector3f& p : mesh.vertices()) sum += p.cast<double>();
  return sum / static_cast<double>(mesh.vertices().size());
}

// B's middle at p_A, turned.
Transform placed(const DopCase& pair, const Eigen::Quaterniond& R_AB, const Eigen::Vector3d& p_A) {
  geometry::Pose X_AB;
  X_AB.rotation = R_AB;
  X_AB.translation = p_A - R_AB * middle(*pair.b);
  const auto transform = to_transform(X_AB);
  PRESCENE_CHECK(transform.ok());
  return *transform;
}

void add_poses(DopCase& pair, std::uint64_t seed) {
  RandomStream random(seed, core::Purpose::kTest);
  const double size = static_cast<double>(pair.a->size()) + static_cast<double>(pair.b->size());
  const auto add = [&](const Transform& X_AB) {
    pair.poses.push_back({X_AB, tests::collide_by_brute_force(*pair.a, *pair.b, X_AB)});
    return pair.poses.back().collides;
  };
  for (int i = 0; i < kPoses; ++i) {
    const double z = random.normal(), y = random.normal(), x = random.normal(), w = random.normal();
    Eigen::Quaterniond R_AB(w, x, y, z);
    R_AB.normalize();
    if (i % 8 == 0) R_AB = Eigen::Quaterniond::Identity();
    const double to_z = random.normal(), to_y = random.normal(), to_x = random.normal();
    const Eigen::Vector3d direction = Eigen::Vector3d(to_x, to_y, to_z).normalized() * size;
    // From apart to where they meet first on the way, or nearly so.
    double apart = 0.6;
    double meeting = -1.0;
    for (double share = 0.5; share >= 0.0 && meeting < 0.0; share -= 0.1) {
      if (add(placed(pair, R_AB, middle(*pair.a) + share * direction))) {
        meeting = share;
      } else {
        apart = share;
      }
    }
    for (int step = 0; step < 26 && meeting >= 0.0; ++step) {
      const double share = 0.5 * (apart + meeting);
      const Transform X_AB = placed(pair, R_AB, middle(*pair.a) + share * direction);
      const bool collides = step < 20 ? tests::collide_by_brute_force(*pair.a, *pair.b, X_AB) : add(X_AB);
      (collides ? meeting : apart) = share;
    }
  }
}

std::vector<DopCase> make_cases() {
  const auto sphere = tests::collision_mesh(tests::make_bumpy_sphere(0.1, 150), "bumpy sphere");
  const auto knot = tests::collision_mesh(tests::make_knot(0.1, 160), "knot");
  const auto sheet = tests::collision_mesh(tests::make_wavy_sheet(0.3, 60), "wavy sheet");
  const auto triangle = mesh_of({{0, 0, 0}, {0.1F, 0, 0}, {0, 0.2F, 0}}, {{0, 1, 2}}, "triangle");
  const auto point = mesh_of({{1, 2, 3}}, {{0, 0, 0}}, "point");
  std::vector<DopCase> cases;
  const auto add = [&](std::string name, std::shared_ptr<const Mesh> a, std::shared_ptr<const Mesh> b) {
    cases.push_back({std::move(name), std::move(a), std::move(b), {}});
    add_poses(cases.back(), cases.size());
  };
  add("smooth", sphere, knot);
  add("open", sheet, knot);
  add("ragged", ragged(120, 1), ragged(90, 2));
  add("one triangle", sphere, triangle);
  add("a point", triangle, point);
  add("off the origin", moved(*sphere, 1.0F, {30, -70, 50}), moved(*knot, 1.0F, {-900, 10, 4}));
  add("huge", moved(*sphere, 1e9F, {0, 0, 0}), moved(*knot, 1e9F, {0, 0, 0}));
  add("tiny", moved(*sphere, 1e-29F, {0, 0, 0}), moved(*knot, 1e-29F, {0, 0, 0}));
  add("huge and tiny", moved(*sphere, 1e9F, {0, 0, 0}), moved(*knot, 1e-29F, {0, 0, 0}));
  return cases;
}

}  // namespace

const std::vector<DopCase>& dop_cases() {
  static const std::vector<DopCase> kCases = make_cases();
  return kCases;
}

}  // namespace prescene::collision
