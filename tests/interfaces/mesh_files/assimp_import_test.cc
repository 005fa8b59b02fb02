// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "prescene/tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::Vector3d;
using testing::HasSubstr;

// One triangle (0,0,0), (1,0,0), (0,1,0); the node moves it by (0, 0, 5). y is up.
constexpr const char* kGltf = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
 "nodes":[{"mesh":0,"translation":[0,0,5]}],
 "meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":4}]}],
 "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
 "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36}],
 "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";

std::string collada(const std::string& up_axis) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>)" +
         up_axis + R"(</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">10 20 30 40 20 30 10 50 30</float_array>
<technique_common><accessor source="#a" count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/>
</vertices><triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

class AssimpImport : public testing::Test {
 protected:
  core::Result<LoadedMesh> read(const char* name, std::string_view text, const MeshReadOptions& options = {}) const {
    EXPECT_TRUE(write_file(scratch_.path() / name, text).ok());
    return read_mesh(scratch_.path() / name, options);
  }
  tests::ScratchDir scratch_;
};

TEST_F(AssimpImport, TurnsGltfFromYUpToZUpAndAppliesItsNodes) {
  const auto mesh = read("a.gltf", kGltf);
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  ASSERT_EQ(mesh->mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh->mesh.vertices[0], Vector3d(0, -5, 0));
  EXPECT_EQ(mesh->mesh.vertices[2], Vector3d(0, -5, 1));
  EXPECT_EQ(read("a.gltf", kGltf, {.metres_per_unit = 2.0, .up_axis = UpAxis::kZ})->mesh.vertices[2],
            Vector3d(0, 2, 10));
}

TEST_F(AssimpImport, FollowsUnitAndUpAxisOfCollada) {
  const auto first = [&](const char* up, const MeshReadOptions& options) -> Vector3d {
    const auto mesh = read("a.dae", collada(up), options);
    EXPECT_TRUE(mesh.ok()) << mesh.status().message();
    return mesh->mesh.vertices[0];
  };
  EXPECT_TRUE(first("Z_UP", {}).isApprox(Vector3d(0.1, 0.2, 0.3), 1e-6));
  EXPECT_TRUE(first("Y_UP", {}).isApprox(Vector3d(0.1, -0.3, 0.2), 1e-6));
  EXPECT_TRUE(first("Y_UP", {.up_axis = UpAxis::kZ}).isApprox(Vector3d(0.1, 0.2, 0.3), 1e-6));
}

TEST_F(AssimpImport, SaysWhatIsWrong) {
  const auto broken = read("a.gltf", "{\"asset\": ").status();
  EXPECT_EQ(broken.code(), StatusCode::kInvalidInput);
  EXPECT_THAT(broken.message(), HasSubstr("a.gltf: cannot be read: "));
  EXPECT_THAT(broken.message(), HasSubstr("export it again, or as PLY, OBJ or STL"));
  EXPECT_FALSE(read("a.glb", "glTF").ok());
  EXPECT_FALSE(read("a.dae", "<COLLADA>").ok());
  EXPECT_EQ(read("a.gltf", kGltf, {.max_assimp_file_bytes = 10}).status().code(), StatusCode::kResourceExhausted);
}

TEST_F(AssimpImport, KnowsTheExtensions) {
  EXPECT_THAT(read("a.step", "").status().message(), HasSubstr("extension '.step' cannot be read; use .ply"));
  EXPECT_EQ(read_mesh(scratch_.path() / "none.PLY").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(mesh_format("a/b.Stl"), MeshFormat::kStl);
  EXPECT_EQ(mesh_format("ply"), std::nullopt);
}

}  // namespace
}  // namespace prescene::interfaces
