// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mesh_files/mesh_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/core/text.h"
#include "prescene/geometry/cancellable.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "raw_mesh.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;
using geometry::TriangleMesh;
using geometry::Vector3d;

// Things that robots handle: see scale_hint().
constexpr double kLargestObject = 10.0;
constexpr double kSmallestObject = 1e-3;

struct Extension {
  std::string_view name;
  MeshFormat format;
};
constexpr std::array<Extension, 6> kExtensions = {{{".ply", MeshFormat::kPly},
                                                   {".obj", MeshFormat::kObj},
                                                   {".stl", MeshFormat::kStl},
                                                   {".gltf", MeshFormat::kGltf},
                                                   {".glb", MeshFormat::kGltf},
                                                   {".dae", MeshFormat::kCollada}}};

/// "96.1 x 82 x 110.4 m".
std::string extent_text(const Vector3d& size) {
  const auto text = [](double length) {
    return core::rounded_text(length > 1.0 ? std::round(10.0 * length) / 10.0 : length);
  };
  return text(size.x()) + " x " + text(size.y()) + " x " + text(size.z()) + " m";
}

Vector3d turned_up(const Vector3d& p, UpAxis up) {
  if (up == UpAxis::kX) return {-p.z(), p.y(), p.x()};
  if (up == UpAxis::kY) return {p.x(), -p.z(), p.y()};
  return p;
}

/// The colour of each vertex that is left after repair, found by its position: repair keeps positions bit for bit.
std::vector<geometry::Rgb> colors_after_repair(const std::vector<Vector3d>& before,
                                               const std::vector<geometry::Rgb>& colors,
                                               const std::vector<Vector3d>& after) {
  if (colors.empty()) return {};
  const auto less = [](const Vector3d& a, const Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].allFinite()) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return less(before[a], before[b]); });
  std::vector<geometry::Rgb> out;
  for (const Vector3d& vertex : after) {
    const auto found = std::lower_bound(order.begin(), order.end(), vertex,
                                        [&](std::size_t i, const Vector3d& p) { return less(before[i], p); });
    PRESCENE_CHECK(found != order.end() && before[*found] == vertex);
    out.push_back(colors[*found]);
  }
  return out;
}

Result<LoadedMesh> finish(RawMesh raw, const MeshReadOptions& options) {
  if (raw.mesh.triangles.empty()) {
    return core::invalid_input("has no triangles (" + std::to_string(raw.mesh.vertices.size()) +
                               " vertices); export a surface, not a point cloud");
  }
  if (!raw.colors.empty() && raw.colors.size() != raw.mesh.vertices.size()) {
    return core::invalid_input("has " + std::to_string(raw.colors.size()) + " colours for " +
                               std::to_string(raw.mesh.vertices.size()) +
                               " vertices; export it with one colour for each vertex, or with none");
  }
  const UpAxis up = options.up_axis == UpAxis::kDeclared ? raw.up_axis : options.up_axis;
  for (Vector3d& vertex : raw.mesh.vertices) vertex = options.metres_per_unit * turned_up(vertex, up);

  LoadedMesh out;
  std::vector<Vector3d> before;
  if (!raw.colors.empty()) before = raw.mesh.vertices;
  Result<TriangleMesh> repaired = geometry::repair_mesh(std::move(raw.mesh), &out.repair, options.cancellation);
  if (!repaired) {
    if (raw.first_non_finite.empty()) return repaired.status();
    return repaired.status().at(raw.first_non_finite + " is the first that is not finite");
  }
  out.mesh = *std::move(repaired);
  out.colors = colors_after_repair(before, raw.colors, out.mesh.vertices);
  out.unread_look = raw.unread_look && out.colors.empty();
  if (const auto hint = scale_hint(geometry::bounding_box(out.mesh), options.metres_per_unit))
    out.warnings.push_back(*hint);
  out.warnings.insert(out.warnings.end(), raw.warnings.begin(), raw.warnings.end());
  if (!raw.first_non_finite.empty()) {
    out.warnings.push_back(raw.first_non_finite +
                           " is the first that is not finite; triangles with such were left out");
  }
  if (out.repair.changed()) out.warnings.push_back(out.repair.text());
  return out;
}

Status check_options(const MeshReadOptions& options) {
  if (options.metres_per_unit > 0.0 && std::isfinite(options.metres_per_unit)) return core::ok_status();
  return core::invalid_input("the scale is " + number_text(options.metres_per_unit) +
                             "; it must be positive, 0.001 for millimetres");
}

std::string lower_case_extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

Result<RawMesh> parse(MeshFormat format, std::span<const std::uint8_t> bytes, const MeshReadOptions& options) {
  if (bytes.empty()) return core::data_loss("is empty; copy or export it again");
  switch (format) {
    case MeshFormat::kPly:
      return parse_ply(bytes, options);
    case MeshFormat::kObj:
      return parse_obj({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, options);
    case MeshFormat::kStl:
      return parse_stl(bytes, options);
    case MeshFormat::kGltf:
    case MeshFormat::kCollada:
      break;
  }
  PRESCENE_CHECK_MSG(false, "glTF and COLLADA are read from files only");
}

Result<RawMesh> read_raw(const std::filesystem::path& path, MeshFormat format, const MeshReadOptions& options) {
  if (format == MeshFormat::kGltf || format == MeshFormat::kCollada) {
    // The importer opens the file again; this is for the errors and the cap.
    PRESCENE_TRY(const InputFile file, InputFile::open(path));
    if (file.size() > options.max_assimp_file_bytes) {
      return core::resource_exhausted(path.string() + ": " + size_text(file.size()) + " are more than the limit of " +
                                      size_text(options.max_assimp_file_bytes) + "; use a smaller file");
    }
    Result<RawMesh> raw = import_with_assimp(path, format, options);
    if (!raw) return raw.status().at(path.string());
    return raw;
  }
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, read_file(path, options.max_file_bytes));
  Result<RawMesh> raw = parse(format, bytes, options);
  if (!raw) return raw.status().at(path.string());
  return raw;
}

}  // namespace

std::optional<MeshFormat> mesh_format(const std::filesystem::path& path) {
  const std::string extension = lower_case_extension(path);
  for (const Extension& known : kExtensions) {
    if (known.name == extension) return known.format;
  }
  return std::nullopt;
}

Result<LoadedMesh> read_mesh(const std::filesystem::path& path, const MeshReadOptions& options) {
  const std::optional<MeshFormat> format = mesh_format(path);
  if (!format) {
    return core::unsupported(path.string() + ": meshes with the extension " + quote(path.extension().string()) +
                             " cannot be read; use .ply, .obj, .stl, .gltf, .glb or .dae");
  }
  const Status valid = check_options(options);
  if (!valid.ok()) return valid.at(path.string());
  PRESCENE_TRY(RawMesh raw, read_raw(path, *format, options));
  Result<LoadedMesh> mesh = finish(std::move(raw), options);
  if (!mesh) return mesh.status().at(path.string());
  return mesh;
}

Result<LoadedMesh> decode_mesh(MeshFormat format, std::span<const std::uint8_t> bytes, const MeshReadOptions& options) {
  PRESCENE_RETURN_IF_ERROR(check_options(options));
  PRESCENE_TRY(RawMesh raw, parse(format, bytes, options));
  return finish(std::move(raw), options);
}

std::optional<std::string> scale_hint(const geometry::Box& box, double metres_per_unit) {
  if (box.isEmpty()) return std::nullopt;
  const geometry::Vector3d size = box.sizes();
  const double longest = size.maxCoeff();
  if (longest <= kLargestObject && longest >= kSmallestObject) return std::nullopt;
  std::string hint = "the bounding box is " + extent_text(size);
  if (metres_per_unit != 1.0) hint += " at the scale " + core::rounded_text(metres_per_unit);
  // That of a file in metres, in millimetres, and of one that was scaled from millimetres once too often.
  for (const double scale : {1.0, 0.001, 1000.0}) {
    const double meant = longest / metres_per_unit * scale;
    if (meant > kLargestObject || meant < kSmallestObject) continue;
    const char* unit = scale == 1.0 ? "in metres" : scale < 1.0 ? "in millimetres" : "scaled by 0.001 already";
    return hint + ": the mesh is probably " + unit + "; set its scale to " + core::rounded_text(scale);
  }
  return hint + ": hardly any object is of this size; check its scale";
}

Status check_triangle_count(std::size_t count, const MeshReadOptions& options) {
  if (options.cancellation && options.cancellation->requested()) return core::cancelled("reading was stopped");
  if (count <= options.max_triangles) return core::ok_status();
  return core::resource_exhausted("has more than the limit of " + std::to_string(options.max_triangles) +
                                  " triangles or vertices; simplify it");
}

void note_vertex(const Vector3d& vertex, const std::string& place_kind, std::size_t place, std::size_t index,
                 RawMesh* mesh) {
  if (vertex.allFinite() || !mesh->first_non_finite.empty()) return;
  mesh->first_non_finite = "vertex " + std::to_string(index) + " (" + place_kind + " " + std::to_string(place) + ")";
}

void append_fan(std::span<const std::uint32_t> corners, TriangleMesh* mesh) {
  for (std::size_t i = 2; i < corners.size(); ++i) {
    mesh->triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

}  // namespace prescene::interfaces
