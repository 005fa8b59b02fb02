// SPDX-License-Identifier: Apache-2.0
// What the readers of each format give: the file's content in its own unit and axes, not repaired.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/status.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"

namespace prescene::interfaces {

struct RawMesh {
  geometry::TriangleMesh mesh;
  std::vector<geometry::Rgb> colors;  ///< One a vertex, or empty.
  UpAxis up_axis = UpAxis::kZ;        ///< Of the coordinates here: kY where assimp has turned them.
  std::vector<std::string> warnings;
  std::string first_non_finite;  ///< "vertex 7 (line 12)", or empty.
  bool unread_look = false;      ///< As of LoadedMesh, whatever `colors` has.
};

core::Result<RawMesh> parse_ply(std::span<const std::uint8_t> bytes, const MeshReadOptions& options);
core::Result<RawMesh> parse_obj(std::string_view text, const MeshReadOptions& options);
core::Result<RawMesh> parse_stl(std::span<const std::uint8_t> bytes, const MeshReadOptions& options);
/// glTF and COLLADA.
core::Result<RawMesh> import_with_assimp(const std::filesystem::path& path, MeshFormat format,
                                         const MeshReadOptions& options);

/// kResourceExhausted when there are more than the options allow, kCancelled once that is requested.
core::Status check_triangle_count(std::size_t count, const MeshReadOptions& options);
/// Remembers the place of the first vertex that is not finite.
void note_vertex(const geometry::Vector3d& vertex, const std::string& place_kind, std::size_t place, std::size_t index,
                 RawMesh* mesh);
/// A polygon as a fan of triangles about its first corner; nothing for fewer than three corners.
void append_fan(std::span<const std::uint32_t> corners, geometry::TriangleMesh* mesh);

}  // namespace prescene::interfaces
