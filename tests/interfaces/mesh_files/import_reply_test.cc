// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/mesh_files/import_reply.h"

#include <gmock/gmock.h>

#include <limits>

#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"

namespace prescene::interfaces {
namespace {

using testing::HasSubstr;

std::vector<std::uint8_t> bytes_of(const core::Result<ImportedMesh>& imported) {
  auto bytes = run_in_child([&](ChildOutput& out) { send_reply(imported, out); }, {});
  EXPECT_TRUE(bytes.ok()) << bytes.status().message();
  return *std::move(bytes);
}

TEST(ImportReply, BringsAMeshToTheBit) {
  ImportedMesh sent{geometry::make_mesh(geometry::Sphere{0.1}, 16), "vertex 7 (mesh 2)"};
  const auto got = decode_reply(bytes_of(sent), {});
  ASSERT_TRUE(got.ok()) << got.status().message();
  EXPECT_TRUE(got->mesh == sent.mesh);
  EXPECT_EQ(got->first_non_finite, sent.first_non_finite);
  for (const bool has_look : {false, true}) {
    const auto again = decode_reply(bytes_of(ImportedMesh{sent.mesh, "", has_look}), {});
    ASSERT_TRUE(again.ok()) << again.status().message();
    EXPECT_EQ(again->has_look, has_look);
    EXPECT_TRUE(again->mesh == sent.mesh);
  }
}

TEST(ImportReply, BringsReasonsFitToBeShown) {
  EXPECT_EQ(decode_reply(bytes_of(core::invalid_input("no \x1b[31m good")), {}).status(),
            core::invalid_input("no ?[31m good"));
  EXPECT_EQ(decode_reply(bytes_of(core::resource_exhausted(std::string(5000, 'x'))), {}).status(),
            core::resource_exhausted(std::string(400, 'x')));
}

TEST(ImportReply, IsTrustedInNothing) {
  const ImportedMesh sent{geometry::make_mesh(geometry::BoxShape{{1, 1, 1}}), "", false};
  const std::vector<std::uint8_t> sound = bytes_of(sent);
  EXPECT_LE(sound.size(), largest_reply({.max_triangles = 12}));
  EXPECT_EQ(decode_reply(sound, {.max_triangles = 11}).status().code(), core::StatusCode::kResourceExhausted);
  for (std::size_t cut = 0; cut < sound.size(); ++cut)
    EXPECT_FALSE(decode_reply(std::span(sound).first(cut), {}).ok()) << cut;
  std::vector<std::uint8_t> longer = sound;
  longer.push_back(0);
  EXPECT_FALSE(decode_reply(longer, {}).ok());
  // Bytes replaced at random: refused, or a mesh whose triangles name its vertices.
  core::RandomStream stream(1, core::Purpose::kTest);
  for (int i = 0; i < 20'000; ++i) {
    std::vector<std::uint8_t> bytes = sound;
    for (std::uint64_t left = 1 + stream.uniform_below(4); left > 0; --left)
      bytes[stream.uniform_below(bytes.size())] = static_cast<std::uint8_t>(stream.uniform_below(256));
    const auto got = decode_reply(bytes, {});
    if (!got) continue;
    for (const auto& triangle : got->mesh.triangles)
      for (const std::uint32_t corner : triangle) ASSERT_LT(corner, got->mesh.vertices.size());
  }
}

}  // namespace
}  // namespace prescene::interfaces
