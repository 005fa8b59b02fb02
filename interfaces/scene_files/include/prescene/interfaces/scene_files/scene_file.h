// SPDX-License-Identifier: Apache-2.0
// Scene files: YAML that a person writes, read into a belief::Scene. docs/reference/scene_files.md is the page for who
// writes them.
//
//   SceneFileOptions options;
//   options.read_mesh = read_mesh;                        // how meshes are read; see MeshReader
//   auto scene = read_scene("scenarios/milk_on_bin.yaml", options);
//   if (!scene) ... scene.status()                        // every mistake: file, line, key, reason, remedy
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/belief/event.h"
#include "prescene/belief/scene.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/scene_files/located_value.h"
#include "prescene/interfaces/scene_files/problems.h"

namespace prescene::interfaces {

/// A mesh that a scene asks for.
struct MeshRequest {
  std::filesystem::path path;  ///< Already relative to the working folder or absolute.
  double scale = 1.0;          ///< Metres per unit of the file.
  bool y_up = false;           ///< The file's y axis points up: it becomes z.
  bool ignores_up = false;     ///< Coordinates stay as they are, whatever axis the file calls up: ROS reads URDF so.
};
/// Reads a mesh into metres with z up; its messages name file and remedy.
using MeshReader = std::function<core::Result<geometry::TriangleMesh>(const MeshRequest&)>;
/// The colours of a mesh that a MeshReader has read before; null where the file has none.
using LookReader = std::function<geometry::LookPtr(const MeshRequest&)>;

/// Reads another file that a scene names whole; errors of read_file().
using FileReader = std::function<core::Result<std::vector<std::uint8_t>>(const std::filesystem::path&)>;

struct SceneFileOptions {
  MeshReader read_mesh;       ///< Empty: meshes and model files that name one are errors.
  LookReader read_look = {};  ///< Empty: meshes have no colours.
  FileReader read_file;       ///< Of model files; empty: from the disk.
  bool follow_files = true;   ///< Else `file:` of a model is an error: the text comes from somebody else.
  /// Remark on models that look the same when they are turned, but name no `symmetry`: a tracker cannot tell the turns
  /// apart. Takes some milliseconds a model.
  bool suggest_symmetries = false;
  YamlLimits limits;
};

/// Everything that was found wrong, for who wants to show it in another form than Status's text.
struct FileReport {
  std::vector<Problem> errors;
  std::vector<Problem> warnings;
  std::vector<Problem> remarks;  ///< What may be better, where SceneFileOptions ask for it.
};

/// Reads and checks a scene; relative paths in it start at the folder of the file they stand in. The status of a
/// failure holds every problem on a line of its own; `report`, if given, holds them one by one, and the warnings and
/// remarks.
core::Result<belief::Scene> read_scene(const std::filesystem::path& path, const SceneFileOptions& options = {},
                                       FileReport* report = nullptr);
/// The same from text; `file` is its name in messages and where relative paths start.
core::Result<belief::Scene> parse_scene(std::string_view text, const std::string& file,
                                        const SceneFileOptions& options = {}, FileReport* report = nullptr);

/// How probable the scene holds events to be (its key `events`), those that it does not name at their defaults. The
/// status of a failure is that of parse_scene for this key alone.
core::Result<belief::EventWeights> parse_event_weights(std::string_view text, const std::string& file);

/// How a simulated recording of the scene is made, where nobody says otherwise (its key `recording`).
struct RecordingRecipe {
  std::optional<std::uint64_t> seed;
  std::optional<double> rate;  ///< Frames a second of each camera.
  bool reports_robot = true;   ///< Else neither the robot's poses nor its actions are published.
  std::string stepper;         ///< "automatic", "bullet" or "lockstep"; "" = not said.
  std::optional<double> step;  ///< s, of the simulation that is recorded alone.
};
/// Of a scene without the key, one that says nothing. The status of a failure is that of parse_scene for this key
/// alone.
core::Result<RecordingRecipe> parse_recording_recipe(std::string_view text, const std::string& file);

}  // namespace prescene::interfaces
