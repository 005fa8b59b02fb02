// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include "prescene/core/check.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "tests/support/collision_meshes.h"
#include "tests/support/paths.h"

namespace prescene::tests {

std::optional<geometry::TriangleMesh> read_recorded_mesh(std::string_view file) {
  const std::optional<std::filesystem::path> folder = data_dir("meshes");
  if (!folder) return std::nullopt;
  core::Result<interfaces::LoadedMesh> loaded = interfaces::read_mesh(*folder / file);
  PRESCENE_CHECK_MSG(loaded.ok(), loaded.status().message());
  return std::move(loaded->mesh);
}

std::string missing_meshes_message() { return missing_data_message("meshes"); }

}  // namespace prescene::tests
