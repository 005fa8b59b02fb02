// SPDX-License-Identifier: Apache-2.0
#include "scenes.h"

#include "prescene/geometry/sampling.h"

namespace prescene::tests {
namespace {

using geometry::TriangleMesh;
using geometry::Vector3d;

/// A sheet of 2 n^2 triangles, z = height(x, y) over a square about the origin: open, seen from both sides.
template <class Height>
TriangleMesh sheet(double size, std::uint32_t n, Height&& height) {
  TriangleMesh mesh;
  for (std::uint32_t j = 0; j <= n; ++j) {
    for (std::uint32_t i = 0; i <= n; ++i) {
      const double x = size * (static_cast<double>(i) / n - 0.5);
      const double y = size * (static_cast<double>(j) / n - 0.5);
      mesh.vertices.push_back({x, y, height(x, y)});
    }
  }
  for (std::uint32_t j = 0; j < n; ++j) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t corner = j * (n + 1) + i;
      mesh.triangles.push_back({corner, corner + 1, corner + n + 2});
      mesh.triangles.push_back({corner, corner + n + 2, corner + n + 1});
    }
  }
  return mesh;
}

TriangleMesh soup(int count, std::uint64_t seed) {
  TriangleMesh mesh;
  core::RandomStream stream(seed, core::Purpose::kTest);
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) {
    const Vector3d centre = 0.08 * geometry::normal_vector(stream);
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(centre + 0.05 * geometry::normal_vector(stream));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

}  // namespace

std::vector<NamedMesh> twenty_meshes() {
  using geometry::BoxShape;
  using geometry::Capsule;
  using geometry::Cone;
  using geometry::Cylinder;
  using geometry::make_mesh;
  using geometry::Sphere;
  const TriangleMesh box = make_mesh(BoxShape{{0.08, 0.05, 0.19}});
  const TriangleMesh ball = make_mesh(Sphere{0.07});
  return {
      {"small sphere", make_mesh(Sphere{0.02}, 12)},
      {"sphere", make_mesh(Sphere{0.09}, 24)},
      {"box", box},
      {"flat box", make_mesh(BoxShape{{0.2, 0.15, 0.004}})},
      {"long box", make_mesh(BoxShape{{0.02, 0.015, 0.4}})},
      {"table", make_mesh(BoxShape{{1.2, 0.8, 0.03}})},
      {"can", make_mesh(Cylinder{0.033, 0.102}, 32)},
      {"coin", make_mesh(Cylinder{0.05, 0.002}, 24)},
      {"pipe", make_mesh(Cylinder{0.01, 0.5}, 8)},
      {"capsule", make_mesh(Capsule{0.03, 0.12}, 16)},
      {"cone", make_mesh(Cone{0.06, 0.16}, 24)},
      {"sharp cone", make_mesh(Cone{0.02, 0.4}, 9)},
      {"bin", geometry::make_open_bin({0.25, 0.2, 0.18}, 0.006)},
      {"thin-walled bin", geometry::make_open_bin({0.3, 0.3, 0.3}, 0.001)},
      {"milk carton", geometry::make_gable_carton(0.07, 0.07, 0.19, 0.23)},
      {"bottle", geometry::make_lathe({{0.035, 0.0}, {0.035, 0.13}, {0.013, 0.17}, {0.013, 0.21}}, 24)},
      {"box with a ball in it", geometry::joined(box, ball)},
      {"wavy sheet", sheet(0.3, 14, [](double x, double y) { return 0.02 * std::sin(40 * x) * std::cos(30 * y); })},
      {"single triangle", {{{-0.1, -0.1, 0.0}, {0.2, 0.0, 0.05}, {0.0, 0.2, -0.05}}, {{0, 1, 2}}}},
      {"triangle soup", soup(60, 11)},
  };
}

geometry::PinholeCamera camera_of_width(int width) {
  const int height = width * 3 / 4;
  const double focal = 0.94 * width;
  return {width, height, focal, 1.003 * focal, 0.493 * width, 0.507 * height};
}

geometry::Pose random_view_pose(const geometry::PinholeCamera& camera, double near, double far,
                                core::RandomStream& stream) {
  geometry::Pose X_CO;
  X_CO.rotation = geometry::uniform_rotation(stream);
  const double depth = stream.uniform(near, far);
  const double u = stream.uniform(0.0, camera.width - 1.0);
  const double v = stream.uniform(0.0, camera.height - 1.0);
  X_CO.translation = camera.unproject(u, v, depth);
  return X_CO;
}

}  // namespace prescene::tests
