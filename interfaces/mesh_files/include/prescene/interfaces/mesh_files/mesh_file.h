// SPDX-License-Identifier: Apache-2.0
// Triangle meshes from and to files: PLY, OBJ and STL by small readers of our own that expect hostile bytes; glTF and
// COLLADA through assimp in a child process with limits of memory and time, which may open regular files of the model's
// folder only. Whatever is read is repaired, with a report.
//
//   PRESCENE_TRY(LoadedMesh cup, read_mesh("cup.stl", {.metres_per_unit = 0.001}));
//   for (const std::string& warning : cup.warnings) core::log(sink, core::LogLevel::kWarning, warning);
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "prescene/core/progress.h"
#include "prescene/core/status.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/triangle_mesh.h"

namespace prescene::interfaces {

/// Which axis of the file points up; it is turned to z, the other axes with it.
enum class UpAxis {
  kDeclared,  ///< What the format or the file says: glTF y, COLLADA its up_axis; PLY, OBJ and STL stay as they are.
  kX,
  kY,
  kZ,
};

enum class MeshFormat { kPly, kObj, kStl, kGltf, kCollada };

struct MeshReadOptions {
  double metres_per_unit = 1.0;  ///< For PLY, OBJ and STL, and on top of the unit that glTF and COLLADA declare.
  UpAxis up_axis = UpAxis::kDeclared;
  std::size_t max_file_bytes = std::size_t{256} << 20;
  std::size_t max_assimp_file_bytes = std::size_t{64} << 20;  ///< For glTF and COLLADA.
  /// Also of vertices. Reading and repairing as many takes less than 1 GB.
  std::size_t max_triangles = 4'000'000;
  std::size_t max_importer_memory = std::size_t{800} << 20;  ///< For glTF and COLLADA: address space.
  std::chrono::milliseconds max_importer_time{8000};         ///< For glTF and COLLADA: by the wall clock.
  const core::Cancellation* cancellation = nullptr;          ///< May be null; else outlives the reading.
};

struct LoadedMesh {
  geometry::TriangleMesh mesh;        ///< Metres, z up, repaired.
  std::vector<geometry::Rgb> colors;  ///< One a vertex, or empty: PLY and OBJ may have them.
  geometry::MeshRepairReport repair;
  std::vector<std::string> warnings;  ///< Sentences for a person: a doubtful unit first, what was repaired.
  /// The file has textures, OBJ materials, or colours of vertices in a format of which they are not read; `colors` is
  /// empty.
  bool unread_look = false;
};

/// What to say of an unread look, and what to do about it.
inline constexpr std::string_view kUnreadLook = "its textures and materials are not read, so that it has no colours";
inline constexpr std::string_view kUnreadLookRemedy =
    "export it as PLY or OBJ with a colour for each vertex, or give the model a 'color'";

/// By the extension, in either case; nothing for an unknown one.
std::optional<MeshFormat> mesh_format(const std::filesystem::path& path);

/// The format goes by the extension: .ply .obj .stl .gltf .glb .dae. Errors of read_file(); kUnsupported for another
/// extension; kDataLoss for a file that is cut; kInvalidInput for wrong content, no triangles, and a scale that is not
/// positive, and where the importer of glTF and COLLADA crashes; kResourceExhausted above a limit, of which its memory
/// and time are two; kCancelled. The text names the path, the line or byte, and the remedy.
///
/// glTF and COLLADA: starts a process by fork(). May be called by any thread, also of several at once.
core::Result<LoadedMesh> read_mesh(const std::filesystem::path& path, const MeshReadOptions& options = {});
/// The same for PLY, OBJ and STL in memory (other formats are bugs of the caller: they need a path).
core::Result<LoadedMesh> decode_mesh(MeshFormat format, std::span<const std::uint8_t> bytes,
                                     const MeshReadOptions& options = {});

/// A sentence when an object of this size (m), read with this scale, is above 10 m or below 1 mm and so hardly meant,
/// with the scale that was probably meant (1, 0.001 or 1000) if there is one; nothing otherwise.
std::optional<std::string> scale_hint(const geometry::Box& box, double metres_per_unit = 1.0);

enum class MeshEncoding { kBinary, kText };

/// PLY with double coordinates (reading gives the same bits) and, if given, one colour and one unit normal a vertex
/// (counts checked). We read no normals.
core::Status write_ply(const std::filesystem::path& path, const geometry::TriangleMesh& mesh,
                       MeshEncoding encoding = MeshEncoding::kBinary, const std::vector<geometry::Rgb>& colors = {},
                       const std::vector<geometry::Vector3d>& normals = {});
/// OBJ; reading gives the same bits.
core::Status write_obj(const std::filesystem::path& path, const geometry::TriangleMesh& mesh);
/// STL: coordinates are rounded to float when binary.
core::Status write_stl(const std::filesystem::path& path, const geometry::TriangleMesh& mesh,
                       MeshEncoding encoding = MeshEncoding::kBinary);

std::string encode_ply(const geometry::TriangleMesh& mesh, MeshEncoding encoding = MeshEncoding::kBinary,
                       const std::vector<geometry::Rgb>& colors = {},
                       const std::vector<geometry::Vector3d>& normals = {});
std::string encode_obj(const geometry::TriangleMesh& mesh);
std::string encode_stl(const geometry::TriangleMesh& mesh, MeshEncoding encoding = MeshEncoding::kBinary);

}  // namespace prescene::interfaces
