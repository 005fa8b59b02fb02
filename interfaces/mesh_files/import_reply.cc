// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mesh_files/import_reply.h"

#include <algorithm>
#include <string>
#include <string_view>

#include "prescene/interfaces/bytes/byte_reader.h"
#include "prescene/interfaces/bytes/text.h"
#include "raw_mesh.h"

namespace prescene::interfaces {
namespace {

using core::Result;
using core::Status;

constexpr std::uint32_t kMagic = 0x50524d31;
constexpr std::uint32_t kMesh = 1;
constexpr std::uint32_t kRefusal = 2;   // The importer says that the file is wrong.
constexpr std::uint32_t kTooLarge = 3;  // More than the options allow.
constexpr std::uint32_t kMeshWithLook = 4;
constexpr std::size_t kMaxText = 400;
constexpr std::size_t kVertexBytes = 3 * sizeof(double);
constexpr std::size_t kCornersBytes = 3 * sizeof(std::uint32_t);

static_assert(sizeof(geometry::Vector3d) == kVertexBytes);
static_assert(sizeof(std::array<std::uint32_t, 3>) == kCornersBytes);

// Both ends are one program on one machine, so numbers keep its byte order.
template <class T>
void send(const T& value, ChildOutput& out) {
  out.write({reinterpret_cast<const std::uint8_t*>(&value), sizeof(T)});
}

void send_text(std::string_view text, ChildOutput& out) {
  text = text.substr(0, kMaxText);
  send(static_cast<std::uint32_t>(text.size()), out);
  out.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

std::string read_text(ByteReader& in) {
  const auto length = in.read<std::uint32_t>();
  const std::span<const std::uint8_t> bytes = in.take(length);
  std::string text(bytes.begin(), bytes.end());
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text.substr(0, kMaxText);
}

Status garbled() { return core::invalid_input("gave an answer that makes no sense"); }

Result<ImportedMesh> read_mesh_reply(ByteReader in, const MeshReadOptions& options) {
  ImportedMesh out;
  out.first_non_finite = read_text(in);
  const auto vertices = in.read<std::uint64_t>();
  const auto triangles = in.read<std::uint64_t>();
  if (!in.ok()) return garbled();
  PRESCENE_RETURN_IF_ERROR(check_triangle_count(std::max(vertices, triangles), options));
  if (in.remaining() != vertices * kVertexBytes + triangles * kCornersBytes) return garbled();
  out.mesh.vertices.resize(vertices);
  for (geometry::Vector3d& vertex : out.mesh.vertices) {
    for (double& x : vertex) x = in.read<double>();
  }
  out.mesh.triangles.resize(triangles);
  for (auto& triangle : out.mesh.triangles) {
    for (std::uint32_t& corner : triangle) {
      corner = in.read<std::uint32_t>();
      if (corner >= vertices) return garbled();
    }
  }
  return out;
}

}  // namespace

void send_reply(const Result<ImportedMesh>& imported, ChildOutput& out) {
  send(kMagic, out);
  if (!imported) {
    send(imported.status().code() == core::StatusCode::kResourceExhausted ? kTooLarge : kRefusal, out);
    send_text(imported.status().message(), out);
    return;
  }
  send(imported->has_look ? kMeshWithLook : kMesh, out);
  send_text(imported->first_non_finite, out);
  const geometry::TriangleMesh& mesh = imported->mesh;
  send(std::uint64_t{mesh.vertices.size()}, out);
  send(std::uint64_t{mesh.triangles.size()}, out);
  out.write({reinterpret_cast<const std::uint8_t*>(mesh.vertices.data()), mesh.vertices.size() * kVertexBytes});
  out.write({reinterpret_cast<const std::uint8_t*>(mesh.triangles.data()), mesh.triangles.size() * kCornersBytes});
}

Result<ImportedMesh> decode_reply(std::span<const std::uint8_t> bytes, const MeshReadOptions& options) {
  ByteReader in(bytes, std::endian::native);
  const auto magic = in.read<std::uint32_t>();
  const auto kind = in.read<std::uint32_t>();
  if (!in.ok() || magic != kMagic) return garbled();
  if (kind == kMesh || kind == kMeshWithLook) {
    PRESCENE_TRY(ImportedMesh mesh, read_mesh_reply(in, options));
    mesh.has_look = kind == kMeshWithLook;
    return mesh;
  }
  const std::string text = read_text(in);
  if (!in.ok() || in.remaining() > 0 || text.empty()) return garbled();
  if (kind == kTooLarge) return core::resource_exhausted(text);
  if (kind == kRefusal) return core::invalid_input(text);
  return garbled();
}

std::size_t largest_reply(const MeshReadOptions& options) {
  return (kVertexBytes + kCornersBytes) * options.max_triangles + 2 * kMaxText;
}

}  // namespace prescene::interfaces
