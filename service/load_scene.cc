// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/load_scene.h"

#include <algorithm>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "prescene/interfaces/scene_files/located_value.h"
#include "prescene/interfaces/scene_files/model_file.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::service {
namespace {

interfaces::SceneFileOptions options(const core::LogSink& log) {
  interfaces::SceneFileOptions options;
  options.read_mesh = [log](const interfaces::MeshRequest& request) -> core::Result<geometry::TriangleMesh> {
    interfaces::MeshReadOptions read;
    read.metres_per_unit = request.scale;
    read.up_axis = request.y_up ? interfaces::UpAxis::kY : interfaces::UpAxis::kDeclared;
    PRESCENE_TRY(interfaces::LoadedMesh mesh, interfaces::read_mesh(request.path, read));
    for (const std::string& warning : mesh.warnings) {
      core::log(log, core::LogLevel::kWarning, request.path.string() + ": " + warning);
    }
    return std::move(mesh.mesh);
  };
  return options;
}

void tell(const interfaces::FileReport& report, const core::LogSink& log) {
  for (const interfaces::Problem& warning : report.warnings) core::log(log, core::LogLevel::kWarning, warning.text());
}

core::Result<std::shared_ptr<const belief::Scene>> shared(core::Result<belief::Scene> scene,
                                                          const interfaces::FileReport& report,
                                                          const core::LogSink& log) {
  tell(report, log);
  if (!scene) return scene.status();
  return std::shared_ptr<const belief::Scene>(std::make_shared<belief::Scene>(*std::move(scene)));
}

}  // namespace

core::Result<std::string> read_scene_text(const std::filesystem::path& path) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(path, interfaces::YamlLimits{}.max_bytes));
  return std::string(bytes.begin(), bytes.end());
}

core::Result<std::shared_ptr<const belief::Scene>> load_scene(const std::filesystem::path& path,
                                                              const core::LogSink& log) {
  PRESCENE_TRY(const std::string text, read_scene_text(path));
  return load_scene_text(text, path, log);
}

core::Result<std::shared_ptr<const belief::Scene>> load_scene_text(const std::string& text,
                                                                   const std::filesystem::path& path,
                                                                   const core::LogSink& log) {
  interfaces::FileReport report;
  return shared(interfaces::parse_scene(text, path.string(), options(log), &report), report, log);
}

bool is_model_file(const std::filesystem::path& path) {
  const auto document = interfaces::read_yaml(path, {});
  return document && document->find("model") && !document->find("models") && !document->find("objects");
}

bool is_learned_file(const std::filesystem::path& path) {
  const auto document = interfaces::read_yaml(path, {});
  return document && document->find("learned") && !document->find("models") && !document->find("objects");
}

core::Result<belief::ObjectModel> load_model(const std::filesystem::path& path, const core::LogSink& log) {
  interfaces::FileReport report;
  core::Result<belief::ObjectModel> model = interfaces::read_model(path, path.stem().string(), options(log), &report);
  tell(report, log);
  return model;
}

std::shared_ptr<const belief::Scene> unknown_scene(const std::filesystem::path& folder, const geometry::Pose& X_WC) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = (folder.filename().empty() ? folder.parent_path() : folder).filename().string();
  scene->gravity_W = 9.81 * (X_WC.rotation * geometry::Vector3d(0.0, 1.0, 1.0).normalized());
  return scene;
}

}  // namespace prescene::service
