// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/pictures/prediction_report.h"

#include <algorithm>
#include <numbers>

#include "prescene/core/text.h"
#include "prescene/geometry/level_camera.h"
#include "prescene/interfaces/reports/report.h"
#include "prescene/rendering/reference/reference_renderer.h"
#include "prescene/rendering/sensor/simulated_camera.h"
#include "prescene/service/pictures/heat_map_picture.h"

namespace prescene::service {
namespace {

using core::fixed_text;

constexpr std::size_t kPosePictures = 6;

/// The scene at its mean start, shaded, as its own camera sees it.
core::Result<geometry::ColorImage> start_picture(const belief::Scene& scene, Backends& backends) {
  PRESCENE_TRY(const auto renderer, backends.make_renderer());
  const belief::SceneCamera& camera = *scene.camera;
  rendering::RenderOptions options;
  options.normals = true;
  const filter::BeliefView view =
      filter::render_scene(scene, belief::mean_start(scene), {}, filter::MeshDetail::kDisplay, backends.meshes());
  rendering::RenderedView images;
  PRESCENE_RETURN_IF_ERROR(renderer->render(view.scene, camera.intrinsics, camera.X_WC, options, &images));
  geometry::ColorImage picture;
  rendering::shade(view.scene, images, camera.X_WC, {}, &picture);
  return picture;
}

/// The mesh as it lies, seen from the side and a little from above.
core::Result<geometry::ColorImage> mesh_picture(const rendering::MeshHandle& mesh, const geometry::Quaterniond& R_WB,
                                                double radius, const geometry::Vector3d& p_BoC) {
  const auto renderer = rendering::make_reference_renderer();
  const geometry::PinholeCamera camera{360, 300, 420.0, 420.0, 179.5, 149.5};
  const geometry::Vector3d forward = geometry::Vector3d(0.5, 0.75, -0.45).normalized();
  const geometry::Pose X_WC{geometry::Quaterniond(geometry::level_camera(forward)), -3.4 * radius * forward};
  rendering::RenderScene scene;
  scene.instances.push_back({mesh, {R_WB, -(R_WB * p_BoC)}, rendering::SurfaceMaterial::opaque({205, 190, 165})});
  rendering::RenderOptions options;
  options.near_depth = 0.1 * radius;
  options.far_depth = 10.0 * radius;
  options.normals = true;
  options.color = !mesh->look.vertex_colors.empty();
  rendering::RenderedView view;
  PRESCENE_RETURN_IF_ERROR(renderer->render(scene, camera, X_WC, options, &view));
  if (options.color) return std::move(view.color);
  geometry::ColorImage picture;
  rendering::shade(scene, view, X_WC, {}, &picture);
  return picture;
}

}  // namespace

core::Status write_prediction_report(const std::filesystem::path& path, const belief::Scene& scene,
                                     const belief::Answer& answer, Backends& backends) {
  const auto& predicted = std::get<belief::PredictAnswer>(answer.what);
  interfaces::ReportContents contents;
  contents.title = scene.name;
  contents.subtitle = "What may happen";
  contents.facts = {{"instances", std::to_string(predicted.instances)},
                    {"simulated", fixed_text(predicted.simulated_seconds, 0) + " s"},
                    {"processor time", fixed_text(predicted.cpu_seconds, 1) + " s"},
                    {"took", fixed_text(predicted.wall_seconds, 1) + " s"}};
  if (!predicted.final_poses.empty()) {
    PRESCENE_TRY(auto picture, heat_map_picture(scene, predicted, backends));
    contents.sections.push_back(
        {"Where things may end", {interfaces::PictureBlock{{{"", std::move(picture), false}}}}});
  }
  if (scene.camera) {
    PRESCENE_TRY(geometry::ColorImage start, start_picture(scene, backends));
    contents.sections.push_back(
        {"The scene",
         {interfaces::PictureBlock{{{"The start, at the means of what is uncertain", std::move(start), false}}}}});
  }
  for (interfaces::ReportSection& section : interfaces::answer_sections(answer, scene))
    contents.sections.push_back(std::move(section));
  return interfaces::write_report(path, contents);
}

core::Status write_mesh_report(const std::filesystem::path& path, const MeshInspection& found) {
  interfaces::ReportContents contents;
  contents.title = found.path.filename().string();
  contents.subtitle = "What the mesh holds";
  const geometry::Vector3d size = found.box.sizes();
  contents.facts = {
      {"triangles", std::to_string(found.loaded.mesh.triangles.size())},
      {"size", fixed_text(size.x(), 4) + " x " + fixed_text(size.y(), 4) + " x " + fixed_text(size.z(), 4) + " m"},
      {"closed", found.topology.watertight() ? "yes" : "no"},
      {"symmetry", symmetry_text(found.symmetry)}};
  if (found.mass)
    contents.facts.emplace_back("mass",
                                fixed_text(found.mass->mass, 4) + " kg at " + fixed_text(found.density, 0) + " kg/m^3");

  const rendering::MeshHandle mesh = rendering::make_render_mesh(found.loaded.mesh, {found.loaded.colors, {}, nullptr});
  const geometry::Vector3d center = found.box.center();
  const double radius = 0.5 * found.box.diagonal().norm();
  interfaces::PictureBlock views;
  PRESCENE_TRY(geometry::ColorImage as_is, mesh_picture(mesh, geometry::Quaterniond::Identity(), radius, center));
  views.pictures.push_back({"As in the file, z up", std::move(as_is), false});
  contents.sections.push_back({"The mesh", {std::move(views)}});

  interfaces::PictureBlock resting;
  for (std::size_t i = 0; i < std::min(kPosePictures, found.resting_poses.size()); ++i) {
    const geometry::RestingPose& pose = found.resting_poses[i];
    PRESCENE_TRY(geometry::ColorImage picture, mesh_picture(mesh, pose.R_WB, radius, center));
    resting.pictures.push_back({fixed_text(100.0 * pose.probability, 1) + " %, falls over at " +
                                    fixed_text(pose.tip_angle * 180.0 / std::numbers::pi, 1) + " deg",
                                std::move(picture), false});
  }
  if (!resting.pictures.empty()) contents.sections.push_back({"How it can lie", {std::move(resting)}});
  std::string remarks;
  for (const std::string& remark : found.remarks) remarks += remark + "\n\n";
  if (!remarks.empty()) contents.sections.push_back({"Remarks", {interfaces::TextBlock{remarks}}});
  return interfaces::write_report(path, contents);
}

}  // namespace prescene::service
