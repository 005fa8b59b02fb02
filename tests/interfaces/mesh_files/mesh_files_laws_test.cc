// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "decode_text.h"
#include "prescene/core/random.h"
#include "prescene/geometry/primitives.h"
#include "prescene/geometry/sampling.h"
#include "prescene/interfaces/bytes/file.h"
#include "tests/support/laws.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using geometry::TriangleMesh;

TriangleMesh random_mesh(core::RandomStream* stream) {
  const double height = stream->uniform(0.05, 0.5), depth = stream->uniform(0.05, 0.5),
               width = stream->uniform(0.05, 0.5);
  const geometry::Vector3d size(width, depth, height);
  const auto segments = static_cast<int>(8 + stream->uniform_below(10));
  TriangleMesh mesh;
  switch (stream->uniform_below(3)) {
    case 0:
      mesh = geometry::make_mesh(geometry::BoxShape{size});
      break;
    case 1:
      mesh = geometry::make_mesh(geometry::Cylinder{size.x(), size.y()}, segments);
      break;
    default:
      mesh = geometry::make_mesh(geometry::Sphere{size.x()}, segments);
  }
  return geometry::transformed(mesh, {geometry::uniform_rotation(*stream), geometry::normal_vector(*stream)});
}

TEST(MeshFileLaws, PlyAndObjGiveTheSameBits) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const TriangleMesh mesh = random_mesh(&stream);
    std::vector<geometry::Rgb> colors(mesh.vertices.size());
    for (auto& color : colors) {
      for (auto& channel : color) channel = static_cast<std::uint8_t>(stream.uniform_below(256));
    }
    std::vector<geometry::Vector3d> normals(mesh.vertices.size());
    for (auto& normal : normals) normal = geometry::normal_vector(stream).normalized();
    for (const MeshEncoding encoding : {MeshEncoding::kBinary, MeshEncoding::kText}) {
      for (const bool with_normals : {false, true}) {
        const auto ply =
            decode_text(MeshFormat::kPly,
                        encode_ply(mesh, encoding, colors, with_normals ? normals : std::vector<geometry::Vector3d>()));
        RC_ASSERT(ply.ok());
        RC_ASSERT(ply->mesh == mesh);
        RC_ASSERT(ply->colors == colors);
      }
    }
    RC_ASSERT(decode_text(MeshFormat::kObj, encode_obj(mesh))->mesh == mesh);
  }));
}

TEST(MeshFileLaws, StlGivesTheSameSurface) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const TriangleMesh mesh = random_mesh(&stream);
    const auto text = decode_text(MeshFormat::kStl, encode_stl(mesh, MeshEncoding::kText));
    const auto binary = decode_text(MeshFormat::kStl, encode_stl(mesh, MeshEncoding::kBinary));
    RC_ASSERT(text.ok() && binary.ok());
    RC_ASSERT(text->mesh.triangles.size() == mesh.triangles.size());
    RC_ASSERT(binary->mesh.vertices.size() == mesh.vertices.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& p = mesh.vertices[mesh.triangles[t][k]];
        RC_ASSERT(text->mesh.vertices[text->mesh.triangles[t][k]] == p);
        RC_ASSERT((binary->mesh.vertices[binary->mesh.triangles[t][k]] - p).cwiseAbs().maxCoeff() < 1e-6);
      }
    }
  }));
}

TEST(MeshFileLaws, FilesAreReadByTheirExtension) {
  const tests::ScratchDir scratch;
  const TriangleMesh mesh = geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}});
  ASSERT_TRUE(write_ply(scratch.path() / "a.ply", mesh).ok());
  ASSERT_TRUE(write_obj(scratch.path() / "a.obj", mesh).ok());
  ASSERT_TRUE(write_stl(scratch.path() / "a.STL", mesh, MeshEncoding::kText).ok());
  for (const char* name : {"a.ply", "a.obj", "a.STL"}) {
    const auto read = read_mesh(scratch.path() / name);
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(read->mesh.triangles.size(), 12U) << name;
    EXPECT_EQ(read->mesh.vertices.size(), 8U) << name;
  }
}

TEST(MeshFileLaws, RandomDamageNeverCrashes) {
  EXPECT_TRUE(tests::check_law([](std::uint64_t seed) {
    core::RandomStream stream(seed, core::Purpose::kTest);
    const TriangleMesh mesh = geometry::make_mesh(geometry::BoxShape{{0.1, 0.2, 0.3}});
    const std::pair<MeshFormat, std::string> files[] = {
        {MeshFormat::kPly, encode_ply(mesh)},
        {MeshFormat::kPly, encode_ply(mesh, MeshEncoding::kText)},
        {MeshFormat::kObj, encode_obj(mesh)},
        {MeshFormat::kStl, encode_stl(mesh)},
        {MeshFormat::kStl, encode_stl(mesh, MeshEncoding::kText)},
    };
    for (auto [format, bytes] : files) {
      for (int i = 0; i < 4; ++i)
        bytes[stream.uniform_below(bytes.size())] = static_cast<char>(stream.uniform_below(256));
      bytes.resize(bytes.size() - stream.uniform_below(bytes.size() / 4));
      const auto read = decode_text(format, bytes);
      if (!read) {
        RC_ASSERT(!read.status().message().empty());
        continue;
      }
      RC_ASSERT(!read->mesh.empty());
      for (const auto& vertex : read->mesh.vertices) RC_ASSERT(vertex.allFinite());
      for (const auto& triangle : read->mesh.triangles) {
        for (const std::uint32_t index : triangle) RC_ASSERT(index < read->mesh.vertices.size());
      }
    }
  }));
}

}  // namespace
}  // namespace prescene::interfaces
