// SPDX-License-Identifier: Apache-2.0
// Scenes from files, with the meshes they name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "prescene/belief/scene.h"
#include "prescene/core/log.h"
#include "prescene/core/status.h"

namespace prescene::interfaces {
struct RobotKinematics;
}

namespace prescene::service {

/// Whether the log gets a remark on each model that looks the same when it is turned, but names no `symmetry`
/// (interfaces::SceneFileOptions::suggest_symmetries): for who tracks the scene.
enum class Symmetries { kAsWritten, kSuggested };

/// Reads a scene file and its meshes; warnings go to the log, and how many meshes were tidied up without changing their
/// surface (load_reported_scene logs each). The status of a failure lists every mistake on a line of its own:
/// file:line: key: reason: remedy.
core::Result<std::shared_ptr<const belief::Scene>> load_scene(const std::filesystem::path& path,
                                                              const core::LogSink& log,
                                                              Symmetries symmetries = Symmetries::kAsWritten);

/// The text of a scene file, to be recorded. Errors of interfaces::read_file.
core::Result<std::string> read_scene_text(const std::filesystem::path& path);

/// The model files and meshes that a scene names, by their paths from the scene's folder ("../models/cup.yaml";
/// absolute where the scene names them so). Meshes are in their own format, but for those of glTF and COLLADA, which
/// are PLY of the mesh as it was read: such a file may need others.
using FilesOfScene = std::map<std::string, std::vector<std::uint8_t>>;

/// load_scene from such a text; files that it names are looked for relative to `path`. `files`, if given, gets their
/// content, for load_carried_scene.
core::Result<std::shared_ptr<const belief::Scene>> load_scene_text(const std::string& text,
                                                                   const std::filesystem::path& path,
                                                                   const core::LogSink& log,
                                                                   FilesOfScene* files = nullptr,
                                                                   Symmetries symmetries = Symmetries::kAsWritten);

/// Content of a file of FilesOfScene by its name.
using CarriedFiles = std::function<core::Result<std::vector<std::uint8_t>>(const std::string& name)>;
/// The same scene, bit for bit, from files that were kept: nothing is read from the disk. `text` and `path` are those
/// that load_scene_text was given.
core::Result<std::shared_ptr<const belief::Scene>> load_carried_scene(const std::string& text,
                                                                      const std::filesystem::path& path,
                                                                      const CarriedFiles& files,
                                                                      const core::LogSink& log,
                                                                      Symmetries symmetries = Symmetries::kAsWritten);

/// How the robot moves that a scene's text describes under robot_description; null where it does not. `text` and `path`
/// as for load_scene_text; errors of interfaces::parse_robot_kinematics.
core::Result<std::shared_ptr<const interfaces::RobotKinematics>> load_robot(const std::string& text,
                                                                            const std::filesystem::path& path);
/// The same from files that were kept, as load_carried_scene.
core::Result<std::shared_ptr<const interfaces::RobotKinematics>> load_carried_robot(const std::string& text,
                                                                                    const std::filesystem::path& path,
                                                                                    const CarriedFiles& files);

/// Whether a YAML file describes one model and no scene; false where it can't be read.
bool is_model_file(const std::filesystem::path& path);
/// Whether a YAML file holds what was learned of physical parameters; false where it can't be read.
bool is_learned_file(const std::filesystem::path& path);

/// A scene of which nothing is known, named after the folder that it was seen in: its support is found and followed. Up
/// is taken to be where a camera at X_WC has it that is held upright and looks down at 45 degrees; the search for the
/// support allows 34 degrees about that.
std::shared_ptr<const belief::Scene> unknown_scene(const std::filesystem::path& folder, const geometry::Pose& X_WC);

}  // namespace prescene::service
