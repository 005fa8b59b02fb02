// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>

#include "prescene/core/check.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"

namespace prescene::interfaces {
namespace {

using core::Status;
using geometry::TriangleMesh;
using geometry::Vector3d;

template <class T>
void append_little_endian(T value, std::string* out) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i)
    *out += raw[std::endian::native == std::endian::little ? i : sizeof(T) - 1 - i];
}

std::string words(const Vector3d& v) {
  return number_text(v.x()) + " " + number_text(v.y()) + " " + number_text(v.z());
}

Vector3d unit_normal(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Vector3d& a = mesh.vertices[triangle[0]];
  const Vector3d normal = (mesh.vertices[triangle[1]] - a).cross(mesh.vertices[triangle[2]] - a);
  const double length = normal.norm();
  return length > 0.0 ? Vector3d(normal / length) : Vector3d::Zero();
}

}  // namespace

std::string encode_ply(const TriangleMesh& mesh, MeshEncoding encoding, const std::vector<geometry::Rgb>& colors,
                       const std::vector<Vector3d>& normals) {
  PRESCENE_CHECK(colors.empty() || colors.size() == mesh.vertices.size());
  PRESCENE_CHECK(normals.empty() || normals.size() == mesh.vertices.size());
  const bool text = encoding == MeshEncoding::kText;
  std::string out = std::string("ply\nformat ") + (text ? "ascii" : "binary_little_endian") + " 1.0\n";
  out += "element vertex " + std::to_string(mesh.vertices.size()) + "\n";
  for (const char* axis : {"x", "y", "z"}) out += std::string("property double ") + axis + "\n";
  if (!normals.empty()) {
    for (const char* axis : {"nx", "ny", "nz"}) out += std::string("property double ") + axis + "\n";
  }
  if (!colors.empty()) {
    for (const char* channel : {"red", "green", "blue"}) out += std::string("property uchar ") + channel + "\n";
  }
  out += "element face " + std::to_string(mesh.triangles.size()) + "\n";
  out += "property list uchar int vertex_indices\nend_header\n";
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (text) {
      out += words(mesh.vertices[i]);
      if (!normals.empty()) out += " " + words(normals[i]);
      if (!colors.empty()) {
        for (const std::uint8_t channel : colors[i]) out += " " + std::to_string(channel);
      }
      out += '\n';
    } else {
      for (const double value : mesh.vertices[i]) append_little_endian(value, &out);
      if (!normals.empty()) {
        for (const double value : normals[i]) append_little_endian(value, &out);
      }
      if (!colors.empty()) out.append(reinterpret_cast<const char*>(colors[i].data()), 3);
    }
  }
  for (const auto& triangle : mesh.triangles) {
    if (text) {
      out += "3";
      for (const std::uint32_t index : triangle) out += " " + std::to_string(index);
      out += '\n';
    } else {
      out += '\3';
      for (const std::uint32_t index : triangle) append_little_endian(index, &out);
    }
  }
  return out;
}

std::string encode_obj(const TriangleMesh& mesh) {
  std::string out;
  for (const Vector3d& vertex : mesh.vertices) out += "v " + words(vertex) + "\n";
  for (const auto& triangle : mesh.triangles) {
    out += "f";
    for (const std::uint32_t index : triangle) out += " " + std::to_string(std::uint64_t{index} + 1);
    out += '\n';
  }
  return out;
}

std::string encode_stl(const TriangleMesh& mesh, MeshEncoding encoding) {
  const bool text = encoding == MeshEncoding::kText;
  std::string out;
  if (text) {
    out = "solid mesh\n";
  } else {
    out.resize(80);
    append_little_endian(static_cast<std::uint32_t>(mesh.triangles.size()), &out);
  }
  for (const auto& triangle : mesh.triangles) {
    const Vector3d normal = unit_normal(mesh, triangle);
    if (text) {
      out += "facet normal " + words(normal) + "\nouter loop\n";
      for (const std::uint32_t index : triangle) out += "vertex " + words(mesh.vertices[index]) + "\n";
      out += "endloop\nendfacet\n";
    } else {
      for (const double value : normal) append_little_endian(static_cast<float>(value), &out);
      for (const std::uint32_t index : triangle) {
        for (const double value : mesh.vertices[index]) append_little_endian(static_cast<float>(value), &out);
      }
      out.append(2, '\0');
    }
  }
  if (text) out += "endsolid mesh\n";
  return out;
}

Status write_ply(const std::filesystem::path& path, const TriangleMesh& mesh, MeshEncoding encoding,
                 const std::vector<geometry::Rgb>& colors, const std::vector<Vector3d>& normals) {
  return write_file(path, std::string_view(encode_ply(mesh, encoding, colors, normals)));
}

Status write_obj(const std::filesystem::path& path, const TriangleMesh& mesh) {
  return write_file(path, std::string_view(encode_obj(mesh)));
}

Status write_stl(const std::filesystem::path& path, const TriangleMesh& mesh, MeshEncoding encoding) {
  return write_file(path, std::string_view(encode_stl(mesh, encoding)));
}

}  // namespace prescene::interfaces
