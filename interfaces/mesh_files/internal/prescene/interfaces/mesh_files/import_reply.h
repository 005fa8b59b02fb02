// SPDX-License-Identifier: Apache-2.0
// What the importer of glTF and COLLADA, which runs in a child process, answers with: a mesh, or why there is none.
// Whoever reads it trusts none of it: code that a file has led astray may have written it.
#pragma once

#include <cstdint>
#include <span>

#include "prescene/core/status.h"
#include "prescene/geometry/triangle_mesh.h"
#include "prescene/interfaces/mesh_files/limited_child.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"

namespace prescene::interfaces {

/// A mesh in the importer's own unit and axes.
struct ImportedMesh {
  geometry::TriangleMesh mesh;
  std::string first_non_finite;  ///< "vertex 7 (mesh 2)", or empty.
  bool has_look = false;         ///< Textures, or colours of vertices.
};

/// For the child.
void send_reply(const core::Result<ImportedMesh>& imported, ChildOutput& out);
/// For the parent: every count, index and length is checked; text is made fit to be shown. kInvalidInput for a mesh
/// that contradicts itself and for the importer's own complaints, kResourceExhausted above the limits.
core::Result<ImportedMesh> decode_reply(std::span<const std::uint8_t> bytes, const MeshReadOptions& options);
/// The longest sound reply.
std::size_t largest_reply(const MeshReadOptions& options);

}  // namespace prescene::interfaces
