// SPDX-License-Identifier: Apache-2.0
// Model files: one object model in YAML, as `prescene inspect MESH -o model.yaml` writes it beside its mesh, as
// `prescene calibrate` writes it of a scene's model, and as a scene's `carton: {file: model.yaml}` refers to it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/belief/object_model.h"
#include "prescene/core/status.h"
#include "prescene/interfaces/scene_files/scene_file.h"

namespace prescene::interfaces {

/// A model whose shape is one mesh file.
struct ModelFile {
  std::string mesh_file;  ///< As it is to stand in the file: relative to the model file's folder.
  double scale = 1.0;     ///< Metres per unit of the mesh file.
  bool y_up = false;
  /// What the mesh collides as, where somebody chose it; else whoever reads the file goes by the mesh.
  std::optional<belief::MeshUse> use;
  belief::ObjectModel model;         ///< Its name, collision and visual are not written: the mesh stands for them.
  std::vector<std::string> remarks;  ///< Written as comments at the top.
};

/// How throws of an object differ from each other beyond what its model says: the key `throws` of a model file, which
/// `prescene calibrate` writes and `prescene evaluate` reads.
struct ModelThrows {
  double position_noise = 0.0;    ///< m, of each coordinate of a frame that a start is read off, in [0, 1].
  double rotation_noise = 0.0;    ///< rad, about each axis, in [0, 3].
  double friction_scatter = 0.0;  ///< Standard deviation of the logarithm of both frictions, in [0, 3].

  friend bool operator==(const ModelThrows&, const ModelThrows&) = default;
};
/// The lines of a model file for it.
std::string throws_yaml(const ModelThrows& throws);

/// The text of the file. What is read back from it equals what was written, to the bit (a symmetry's axis to the last).
std::string model_yaml(const ModelFile& file);
/// Writes it; fails as write_file does.
core::Status write_model(const std::filesystem::path& path, const ModelFile& file);

/// The text of a model file for the model `name` of a scene file: everything as it is described there (or in the model
/// file that is named there), but centre of mass, unit inertia and contact properties those of `fitted`. Paths in it
/// are made relative to `folder`. `remarks` as in ModelFile. Errors as read_yaml; kNotFound where there is no such
/// model.
core::Result<std::string> fitted_model_yaml(const std::filesystem::path& scene, const std::string& name,
                                            const belief::ObjectModel& fitted, const std::filesystem::path& folder,
                                            const std::vector<std::string>& remarks = {},
                                            const YamlLimits& limits = {});
/// Reads a model file on its own and gives the model a name. What the file says of throws, if anything, goes to
/// `throws`, which may be null.
core::Result<belief::ObjectModel> read_model(const std::filesystem::path& path, const std::string& name,
                                             const SceneFileOptions& options = {}, FileReport* report = nullptr,
                                             std::optional<ModelThrows>* throws = nullptr);
/// The same from text; `file` is its name in messages and where relative paths start.
core::Result<belief::ObjectModel> parse_model(std::string_view text, const std::string& file, const std::string& name,
                                              const SceneFileOptions& options = {}, FileReport* report = nullptr,
                                              std::optional<ModelThrows>* throws = nullptr);

}  // namespace prescene::interfaces
