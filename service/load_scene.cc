// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/load_scene.h"

#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <tuple>

#include "lockstep_hull.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "prescene/interfaces/scene_files/located_value.h"
#include "prescene/interfaces/scene_files/model_file.h"
#include "prescene/interfaces/scene_files/robot_description.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/service/scene_report.h"

namespace prescene::service {
namespace {

interfaces::MeshReadOptions mesh_options(const interfaces::MeshRequest& request) {
  interfaces::MeshReadOptions read;
  read.metres_per_unit = request.scale;
  if (request.y_up) read.up_axis = interfaces::UpAxis::kY;
  if (request.ignores_up) read.up_axis = interfaces::UpAxis::kZ;
  return read;
}

/// How what was tidied up in meshes without changing their surface is reported: each, or only of how many meshes.
enum class Repairs { kEach, kCounted };

/// Logs what is odd about a scene's meshes.
class MeshRemarks {
 public:
  MeshRemarks(core::LogSink log, Repairs repairs) : log_(std::move(log)), repairs_(repairs) {}

  void add(const interfaces::MeshRequest& request, const interfaces::LoadedMesh& mesh) {
    const bool keeps_surface = mesh.repair.non_finite_vertices == 0 && mesh.repair.out_of_range_triangles == 0;
    const bool counted = repairs_ == Repairs::kCounted && mesh.repair.changed() && keeps_surface;
    if (counted) ++tidied_;
    for (const std::string& warning : mesh.warnings)
      if (!counted || warning != mesh.repair.text())
        core::log(log_, core::LogLevel::kWarning, request.path.string() + ": " + warning);
    // The links of a robot have the colours that its description gives.
    if (mesh.unread_look && !request.ignores_up) unread_looks_.insert(request.path.string());
  }
  /// Names each mesh whose textures are not read.
  void remark_on_looks(interfaces::FileReport& report) const {
    for (const std::string& file : unread_looks_)
      report.remarks.push_back(
          {file, 0, 0, "", std::string(interfaces::kUnreadLook), std::string(interfaces::kUnreadLookRemedy)});
  }
  /// To be called when all meshes were read.
  void finish(const std::filesystem::path& scene) const {
    if (tidied_ == 0) return;
    core::log(log_, core::LogLevel::kInfo,
              scene.string() + ": " + std::to_string(tidied_) + (tidied_ == 1 ? " mesh has" : " meshes have") +
                  " triangles or vertices that were tidied up; 'prescene validate' says which");
  }

 private:
  core::LogSink log_;
  Repairs repairs_;
  int tidied_ = 0;
  std::set<std::string> unread_looks_;
};

/// The colours of the meshes that a scene has read.
class Looks {
 public:
  void note(const interfaces::MeshRequest& request, const interfaces::LoadedMesh& mesh) {
    if (mesh.colors.empty()) return;
    auto look = std::make_shared<geometry::MeshLook>();
    look->vertex_colors = mesh.colors;
    looks_[key(request)] = std::move(look);
  }
  geometry::LookPtr of(const interfaces::MeshRequest& request) const {
    const auto found = looks_.find(key(request));
    return found == looks_.end() ? nullptr : found->second;
  }

 private:
  using Key = std::tuple<std::string, double, bool>;
  static Key key(const interfaces::MeshRequest& request) {
    return {request.path.string(), request.scale, request.y_up};
  }
  std::map<Key, geometry::LookPtr> looks_;
};

/// PLY, OBJ and STL are whole in one file.
bool is_whole(interfaces::MeshFormat format) {
  return format != interfaces::MeshFormat::kGltf && format != interfaces::MeshFormat::kCollada;
}

/// Of a file that a scene names, in FilesOfScene.
std::string carried_name(const std::filesystem::path& path, const std::filesystem::path& scene) {
  const std::filesystem::path relative =
      scene.parent_path().empty() ? path : path.lexically_relative(scene.parent_path());
  return (relative.empty() ? path : relative).generic_string();  // empty: absolute, beside a scene whose path is not
}

std::string carried_mesh_name(const interfaces::MeshRequest& request, const std::filesystem::path& scene) {
  std::string name = carried_name(request.path, scene);
  const auto format = interfaces::mesh_format(request.path);
  if (!format || is_whole(*format)) return name;
  return name + "@" + core::rounded_text(request.scale) + (request.y_up ? "y" : "") + (request.ignores_up ? "z" : "") +
         ".ply";
}

/// `remarks` must outlive the options.
interfaces::SceneFileOptions options(MeshRemarks& remarks, const std::filesystem::path& scene = {},
                                     FilesOfScene* files = nullptr) {
  interfaces::SceneFileOptions options;
  const auto looks = std::make_shared<Looks>();
  options.read_look = [looks](const interfaces::MeshRequest& request) { return looks->of(request); };
  options.read_mesh = [=, &remarks](const interfaces::MeshRequest& request) -> core::Result<geometry::TriangleMesh> {
    const interfaces::MeshReadOptions read = mesh_options(request);
    const auto format = interfaces::mesh_format(request.path);
    if (files && format && is_whole(*format)) {
      PRESCENE_TRY(std::vector<std::uint8_t> bytes, interfaces::read_file(request.path, read.max_file_bytes));
      auto mesh = interfaces::decode_mesh(*format, bytes, read);
      if (!mesh) return mesh.status().at(request.path.string());
      (*files)[carried_mesh_name(request, scene)] = std::move(bytes);
      remarks.add(request, *mesh);
      looks->note(request, *mesh);
      return std::move(mesh->mesh);
    }
    PRESCENE_TRY(interfaces::LoadedMesh mesh, interfaces::read_mesh(request.path, read));
    remarks.add(request, mesh);
    looks->note(request, mesh);
    if (files) {
      const std::string ply = interfaces::encode_ply(mesh.mesh, interfaces::MeshEncoding::kBinary, mesh.colors);
      (*files)[carried_mesh_name(request, scene)] = {ply.begin(), ply.end()};
    }
    return std::move(mesh.mesh);
  };
  if (!files) return options;
  options.read_file = [=, limit = options.limits.max_bytes](const std::filesystem::path& path) {
    auto bytes = interfaces::read_file(path, limit);
    if (bytes) (*files)[carried_name(path, scene)] = *bytes;
    return bytes;
  };
  return options;
}

interfaces::SceneFileOptions carried_options(const std::filesystem::path& scene, const CarriedFiles& files) {
  interfaces::SceneFileOptions options;
  options.read_file = [=](const std::filesystem::path& path) { return files(carried_name(path, scene)); };
  const auto looks = std::make_shared<Looks>();
  options.read_look = [looks](const interfaces::MeshRequest& request) { return looks->of(request); };
  options.read_mesh = [=](const interfaces::MeshRequest& request) -> core::Result<geometry::TriangleMesh> {
    const auto format = interfaces::mesh_format(request.path);
    if (!format) return core::unsupported(request.path.string() + ": not a readable mesh");
    PRESCENE_TRY(const std::vector<std::uint8_t> bytes, files(carried_mesh_name(request, scene)));
    // Scale and axis are in the PLY already. What is odd about the mesh was said when it was recorded.
    const bool whole = is_whole(*format);
    auto mesh = interfaces::decode_mesh(whole ? *format : interfaces::MeshFormat::kPly, bytes,
                                        whole ? mesh_options(request) : interfaces::MeshReadOptions{});
    if (!mesh) return mesh.status().at(request.path.string());
    looks->note(request, *mesh);
    return std::move(mesh->mesh);
  };
  return options;
}

interfaces::SceneFileOptions with(interfaces::SceneFileOptions options, Symmetries symmetries) {
  options.suggest_symmetries = symmetries == Symmetries::kSuggested;
  return options;
}

/// Of supports and robot bodies: what is drawn of them in each frame has at most so many triangles (filter::MeshCache).
constexpr std::size_t kMostDrawn = 20'000;

void remark_on_large_surroundings(const belief::Scene& scene, const std::filesystem::path& path,
                                  interfaces::FileReport& report) {
  const auto look_at = [&](const std::string& key, const auto& body) {
    const std::size_t triangles =
        body.visual ? body.visual->triangles.size() : belief::collision_mesh(body.collision).triangles.size();
    if (triangles <= kMostDrawn) return;
    report.remarks.push_back(
        {path.string(), 0, 0, key + "." + body.name,
         "of its " + std::to_string(triangles) + " triangles at most " + std::to_string(kMostDrawn) +
             " are drawn for what a camera should see, so that details are lost; things still rest "
             "on all of it",
         "give it parts, or a 'visual' mesh of fewer triangles, if small details matter"});
  };
  for (const belief::Support& support : scene.supports) look_at("supports", support);
  for (const belief::KinematicBody& body : scene.robot) look_at("robot", body);
}

void log_warnings(const interfaces::FileReport& report, const core::LogSink& log) {
  for (const interfaces::Problem& warning : report.warnings) core::log(log, core::LogLevel::kWarning, warning.text());
}

core::Result<std::shared_ptr<const belief::Scene>> shared(core::Result<belief::Scene> scene,
                                                          const interfaces::FileReport& report,
                                                          const core::LogSink& log) {
  log_warnings(report, log);
  if (!scene) return scene.status();
  return std::shared_ptr<const belief::Scene>(std::make_shared<belief::Scene>(*std::move(scene)));
}

void log_remarks(const interfaces::FileReport& report, const core::LogSink& log) {
  for (const interfaces::Problem& remark : report.remarks) core::log(log, core::LogLevel::kInfo, remark.text());
}

}  // namespace

core::Result<std::string> read_scene_text(const std::filesystem::path& path) {
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(path, interfaces::YamlLimits{}.max_bytes));
  return std::string(bytes.begin(), bytes.end());
}

core::Result<std::shared_ptr<const belief::Scene>> load_scene(const std::filesystem::path& path,
                                                              const core::LogSink& log, Symmetries symmetries) {
  PRESCENE_TRY(const std::string text, read_scene_text(path));
  return load_scene_text(text, path, log, nullptr, symmetries);
}

core::Result<std::shared_ptr<const belief::Scene>> load_scene_text(const std::string& text,
                                                                   const std::filesystem::path& path,
                                                                   const core::LogSink& log, FilesOfScene* files,
                                                                   Symmetries symmetries) {
  interfaces::FileReport report;
  MeshRemarks remarks(log, Repairs::kCounted);
  auto scene = interfaces::parse_scene(text, path.string(), with(options(remarks, path, files), symmetries), &report);
  remarks.finish(path);
  if (scene) remark_on_large_surroundings(*scene, path, report);
  log_remarks(report, log);
  return shared(std::move(scene), report, log);
}

core::Result<std::shared_ptr<const belief::Scene>> load_reported_scene(const std::string& text,
                                                                       const std::filesystem::path& path,
                                                                       const core::LogSink& log,
                                                                       interfaces::FileReport& report,
                                                                       Symmetries symmetries) {
  MeshRemarks remarks(log, Repairs::kEach);
  auto scene = interfaces::parse_scene(text, path.string(), with(options(remarks, path), symmetries), &report);
  if (scene) remark_on_large_surroundings(*scene, path, report);
  if (scene) remarks.remark_on_looks(report);
  if (scene && symmetries == Symmetries::kSuggested) remark_on_simplified_hulls(*scene, path.string(), report);
  return shared(std::move(scene), report, log);
}

core::Result<std::shared_ptr<const belief::Scene>> load_carried_scene(const std::string& text,
                                                                      const std::filesystem::path& path,
                                                                      const CarriedFiles& files,
                                                                      const core::LogSink& log, Symmetries symmetries) {
  interfaces::FileReport report;
  auto scene = interfaces::parse_scene(text, path.string(), with(carried_options(path, files), symmetries), &report);
  log_remarks(report, log);
  return shared(std::move(scene), report, log);
}

core::Result<std::shared_ptr<const interfaces::RobotKinematics>> load_robot(const std::string& text,
                                                                            const std::filesystem::path& path) {
  return interfaces::parse_robot_kinematics(text, path.string());
}

core::Result<std::shared_ptr<const interfaces::RobotKinematics>> load_carried_robot(const std::string& text,
                                                                                    const std::filesystem::path& path,
                                                                                    const CarriedFiles& files) {
  return interfaces::parse_robot_kinematics(text, path.string(), carried_options(path, files));
}

bool is_model_file(const std::filesystem::path& path) {
  interfaces::Problems repeated_keys;  // the file is one for all that
  const auto document = interfaces::read_yaml(path, {}, &repeated_keys);
  return document && document->find("model") && !document->find("models") && !document->find("objects");
}

bool is_learned_file(const std::filesystem::path& path) {
  interfaces::Problems repeated_keys;  // the file is one for all that
  const auto document = interfaces::read_yaml(path, {}, &repeated_keys);
  return document && document->find("learned") && !document->find("models") && !document->find("objects");
}

core::Result<belief::ObjectModel> load_reported_model(const std::filesystem::path& path, const core::LogSink& log,
                                                      interfaces::FileReport& report, Symmetries symmetries) {
  MeshRemarks remarks(log, Repairs::kEach);
  core::Result<belief::ObjectModel> model =
      interfaces::read_model(path, path.stem().string(), with(options(remarks), symmetries), &report);
  if (model) remarks.remark_on_looks(report);
  if (model && symmetries == Symmetries::kSuggested) remark_on_simplified_hulls(*model, path.string(), report);
  log_warnings(report, log);
  return model;
}

std::shared_ptr<const belief::Scene> unknown_scene(const std::filesystem::path& folder, const geometry::Pose& X_WC) {
  auto scene = std::make_shared<belief::Scene>();
  scene->name = (folder.filename().empty() ? folder.parent_path() : folder).filename().string();
  scene->gravity_W = 9.81 * (X_WC.rotation * geometry::Vector3d(0.0, 1.0, 1.0).normalized());
  return scene;
}

}  // namespace prescene::service
