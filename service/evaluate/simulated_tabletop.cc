// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/evaluate/simulated_tabletop.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "suite_camera.h"

namespace prescene::service {
namespace {

using geometry::Pose;
using geometry::TriangleMesh;
using geometry::Vector3d;
using rendering::RenderScene;

constexpr double kTableHalf = 4.0;  // m: further than the camera's range

TabletopObject centred(const std::string& name, TriangleMesh mesh) {
  const rendering::MeshHandle measured = rendering::make_render_mesh(mesh);
  for (Vector3d& vertex : mesh.vertices) vertex -= measured->centre.cast<double>();
  return {name, rendering::make_render_mesh(mesh)};
}

rendering::MeshHandle table_mesh() {
  TriangleMesh mesh;
  mesh.vertices = {{-kTableHalf, -kTableHalf, 0},
                   {kTableHalf, -kTableHalf, 0},
                   {kTableHalf, kTableHalf, 0},
                   {-kTableHalf, kTableHalf, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return rendering::make_render_mesh(mesh);
}

/// On the table, under the origin's z axis.
Pose lying(const rendering::RenderMesh& mesh, core::RandomStream& stream) {
  Pose X_WO{geometry::uniform_rotation(stream), Vector3d::Zero()};
  double lowest = std::numeric_limits<double>::infinity();
  for (const auto& vertex : mesh.vertices) lowest = std::min(lowest, (X_WO.rotation * vertex.cast<double>()).z());
  X_WO.translation.z() = -lowest;
  return X_WO;
}

/// A box between object and camera, beside the line of sight as often as on it.
rendering::RenderInstance unknown_box(const Vector3d& towards_camera, double object_radius,
                                      core::RandomStream& stream) {
  const double height = stream.uniform(0.05, 0.12), depth = stream.uniform(0.04, 0.10);
  const Vector3d size(stream.uniform(0.04, 0.10), depth, height);
  const Vector3d ahead = Vector3d(towards_camera.x(), towards_camera.y(), 0.0).normalized();
  const Vector3d aside = ahead.cross(Vector3d::UnitZ());
  const double gap = object_radius + 0.5 * std::hypot(size.x(), size.y()) + stream.uniform(0.0, 0.05);
  const double offset = stream.uniform(-1.5, 1.5) * object_radius;
  Pose X_WM = Pose::from_translation(gap * ahead + offset * aside + 0.5 * size.z() * Vector3d::UnitZ());
  X_WM.rotation = geometry::exp_rotation({0.0, 0.0, stream.uniform(0.0, std::numbers::pi)});
  return {rendering::make_render_mesh(geometry::make_mesh(geometry::BoxShape{size})), X_WM, {}};
}

}  // namespace

std::vector<TabletopObject> tabletop_objects() {
  using namespace geometry;  // NOLINT(google-build-using-namespace): shapes only, in this function only
  return {
      centred("carton", make_gable_carton(0.07, 0.07, 0.19, 0.23)),
      centred("flat box", make_mesh(BoxShape{{0.16, 0.21, 0.06}})),
      centred("small box", make_mesh(BoxShape{{0.09, 0.07, 0.03}})),
      centred("can", make_mesh(Cylinder{0.034, 0.10}, 24)),
      centred("bottle",
              make_lathe({{0.0, 0.0}, {0.035, 0.0}, {0.035, 0.12}, {0.013, 0.17}, {0.013, 0.20}, {0.0, 0.20}}, 24)),
      centred("cup",
              make_lathe({{0.0, 0.0}, {0.030, 0.0}, {0.042, 0.09}, {0.039, 0.09}, {0.028, 0.004}, {0.0, 0.004}}, 24)),
      centred("bin", make_open_bin({0.14, 0.09, 0.06}, 0.005)),
      centred("ball", make_mesh(Sphere{0.037}, 24))};
}

core::Result<TabletopFrame> simulate_tabletop(const TabletopObject& object, double distance, std::uint64_t index,
                                              const rendering::SimulatedCamera& simulated,
                                              rendering::Renderer& renderer, const core::RandomStream& stream) {
  TabletopFrame frame;
  frame.camera = {640, 480, 570.0, 570.0, 319.5, 239.5};
  core::RandomStream draws = stream.for_purpose(core::Purpose::kScenario).at(index);
  const Pose X_WO = lying(*object.mesh, draws);
  const double elevation = draws.uniform(25.0, 65.0) * std::numbers::pi / 180.0;
  const double azimuth = draws.uniform(0.0, 2.0 * std::numbers::pi);
  const Vector3d towards_camera(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                                std::sin(elevation));
  const Vector3d aim = X_WO.translation + 0.03 * geometry::normal_vector(draws);
  const Pose X_WC = looking_at(X_WO.translation + distance * towards_camera, aim);
  frame.X_CO = X_WC.inverse() * X_WO;
  frame.table.plane_C = geometry::transformed({Vector3d::UnitZ(), 0.0}, X_WC.inverse());

  RenderScene scene;
  scene.instances.push_back({object.mesh, X_WO, {}});
  scene.instances.push_back({table_mesh(), Pose::identity(), {}});
  if (index % 2 == 1)
    scene.instances.push_back(unknown_box(towards_camera, static_cast<double>(object.mesh->radius), draws));
  rendering::RenderOptions options;
  options.normals = true;
  rendering::RenderedView view;
  PRESCENE_RETURN_IF_ERROR(renderer.render(scene, frame.camera, X_WC, options, &view));
  simulated.sample(scene, view, nullptr, frame.camera, X_WC, stream.for_purpose(core::Purpose::kSensorNoise), index,
                   &frame.depth, nullptr);
  return frame;
}

}  // namespace prescene::service
