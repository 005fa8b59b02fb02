// SPDX-License-Identifier: Apache-2.0
// For builds of parts that have no reader of mesh files.
#include "tests/support/collision_meshes.h"

namespace prescene::tests {

std::optional<geometry::TriangleMesh> read_recorded_mesh(std::string_view) { return std::nullopt; }

std::string missing_meshes_message() {
  return "skipped: this build has no library interfaces_mesh_files to read meshes with";
}

}  // namespace prescene::tests
