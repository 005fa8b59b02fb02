// SPDX-License-Identifier: Apache-2.0
// Any bytes as the answer of the importer of glTF and COLLADA, which is a process that files may have led astray. The
// importer itself is not fuzzed here but in tests/interfaces/mesh_files/hostile_meshes_test.cc: it is a library built
// without instrumentation, and its crashes stay in its process.
#include "prescene/interfaces/mesh_files/import_reply.h"

#include "prescene/core/check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace prescene;
  const interfaces::MeshReadOptions options{.max_triangles = 100'000};
  const auto imported = interfaces::decode_reply({data, size}, options);
  if (!imported) {
    PRESCENE_CHECK(!imported.status().message().empty());
    return 0;
  }
  PRESCENE_CHECK(size <= interfaces::largest_reply(options));
  for (const char c : imported->first_non_finite) PRESCENE_CHECK(c >= ' ' && c <= '~');
  for (const auto& triangle : imported->mesh.triangles) {
    for (const std::uint32_t corner : triangle) PRESCENE_CHECK(corner < imported->mesh.vertices.size());
  }
  return 0;
}
