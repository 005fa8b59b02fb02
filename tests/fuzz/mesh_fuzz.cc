// SPDX-License-Identifier: Apache-2.0
#include "prescene/core/check.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"

using namespace prescene::interfaces;  // NOLINT(google-build-using-namespace)

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto loaded = decode_mesh(MeshFormat::PRESCENE_MESH_FORMAT, {data, size}, {.max_triangles = 100'000});
  if (!loaded) {
    PRESCENE_CHECK(!loaded.status().message().empty());
    return 0;
  }
  const auto& mesh = loaded->mesh;
  PRESCENE_CHECK(!mesh.triangles.empty());
  PRESCENE_CHECK(loaded->colors.empty() || loaded->colors.size() == mesh.vertices.size());
  for (const auto& vertex : mesh.vertices) PRESCENE_CHECK(vertex.allFinite());
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) PRESCENE_CHECK(index < mesh.vertices.size());
  }
  return 0;
}
