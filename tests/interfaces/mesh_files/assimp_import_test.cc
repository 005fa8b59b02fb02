// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <utility>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/mesh_files/limited_child.h"
#include "prescene/interfaces/mesh_files/mesh_file.h"
#include "tests/support/paths.h"

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

TEST_F(AssimpImport, NotesTexturesThatAreNotRead) {
  EXPECT_FALSE(read("a.gltf", kGltf)->unread_look);
  std::string textured = kGltf;
  const std::string mode = R"("mode":4)";
  textured.replace(textured.find(mode), mode.size(), mode + R"(,"material":0)");
  textured.insert(textured.rfind('}'), R"(,"materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],
 "textures":[{"source":0}],"images":[{"uri":"a.png"}])");
  const auto mesh = read("b.gltf", textured);
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  EXPECT_TRUE(mesh->unread_look);
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

// What used to end this process, or to keep it for ever.
TEST_F(AssimpImport, OutlivesFilesThatTheImporterDoesNot) {
  const std::string text = kGltf;
  const auto with = [&](std::string_view what, const std::string& by) {
    std::string changed = text;
    return changed.replace(changed.find(what), what.size(), by);
  };
  std::string nodes;
  for (int i = 1; i <= 50'000; ++i) nodes += "{\"children\":[" + std::to_string(i) + "]},";
  const std::string deep = with("{\"mesh\":0,\"translation\":[0,0,5]}", nodes + "{\"mesh\":0}");
  const std::string brackets = std::string(2'000'000, '[') + std::string(2'000'000, ']');
  std::string first = "<library_geometries>";
  std::string collada_deep = collada("Z_UP");
  collada_deep.replace(collada_deep.find("<node>"), 6, [] {
    std::string nested;
    for (int i = 0; i < 100'000; ++i) nested += "<node>";
    for (int i = 0; i < 100'000; ++i) nested += "</node>";
    return nested + "<node>";
  }());
  std::string collada_self = collada("Z_UP");
  collada_self.replace(collada_self.find(first), first.size(),
                       R"(<library_nodes><node id="n"><instance_node url="#n"/></node></library_nodes>)" + first);
  collada_self.replace(collada_self.find(R"(<instance_geometry url="#g"/>)"), 29, R"(<instance_node url="#n"/>)");
  std::string collada_stride = collada("Z_UP");
  collada_stride.replace(collada_stride.find(R"(stride="3")"), 10, R"(stride="4000000000")");
  const std::pair<const char*, std::string> files[] = {
      {"a.gltf", deep},
      {"a.gltf", with("\"scene\":0", "\"extras\":" + brackets + ",\"scene\":0")},
      {"a.gltf", with("\"translation\":[0,0,5]", "\"children\":[0]")},
      {"a.gltf", with("\"byteLength\":36", "\"byteLength\":36,\"byteStride\":2147483644")},
      {"a.dae", collada_deep},
      {"a.dae", collada_self},
      {"a.dae", collada_stride}};
  for (const auto& [name, bytes] : files) {
    const auto mesh = read(name, bytes);
    ASSERT_FALSE(mesh.ok()) << bytes.substr(0, 200);
    EXPECT_EQ(mesh.status().code(), StatusCode::kInvalidInput) << mesh.status().message();
    EXPECT_THAT(mesh.status().message(), HasSubstr("PLY, OBJ or STL")) << "the remedy";
  }
  const core::Status crash = read("a.gltf", deep).status();
  if (child_memory_is_limited()) {
    EXPECT_THAT(crash.message(),
                HasSubstr("a.gltf: the importer crashed (signal 11); convert it to PLY, OBJ or STL, for instance"));
  }
}

TEST_F(AssimpImport, HasLimitsOfMemoryAndTime) {
  // 2^40 nodes by way of 41.
  std::string nodes;
  for (int i = 1; i <= 40; ++i) nodes += "{\"children\":[" + std::to_string(i) + "," + std::to_string(i) + "]},";
  std::string graph = kGltf;
  const std::string node = "{\"mesh\":0,\"translation\":[0,0,5]}";
  graph.replace(graph.find(node), node.size(), nodes + "{\"mesh\":0}");
  if (child_memory_is_limited()) {
    const core::Status memory =
        read("a.gltf", graph,
             {.max_importer_memory = std::size_t{64} << 20, .max_importer_time = std::chrono::minutes(2)})
            .status();
    EXPECT_EQ(memory.code(), StatusCode::kResourceExhausted);
    EXPECT_THAT(memory.message(), HasSubstr("a.gltf: the importer ran out of its 64.0 MiB of memory; convert it"));
  }
  const core::Status time = read("a.gltf", graph, {.max_importer_time = std::chrono::milliseconds(1)}).status();
  EXPECT_EQ(time.code(), StatusCode::kResourceExhausted);
  EXPECT_THAT(time.message(), HasSubstr("a.gltf: the importer did not finish within 0.001 s; convert it"));
  core::Cancellation cancellation;
  cancellation.request();
  EXPECT_EQ(read("a.gltf", kGltf, {.cancellation = &cancellation}).status().code(), StatusCode::kCancelled);
}

TEST_F(AssimpImport, OpensRegularFilesBelowTheModelsFolderOnly) {
  const std::filesystem::path folder = scratch_.path() / "models";
  ASSERT_TRUE(std::filesystem::create_directories(folder / "below"));
  const std::string buffer =
      std::string(14, '\0') + "\x80\x3f" + std::string(14, '\0') + "\x80\x3f" + std::string(4, '\0');
  ASSERT_TRUE(write_file(scratch_.path() / "outside.bin", buffer).ok());
  ASSERT_TRUE(write_file(folder / "below" / "b.bin", buffer).ok());
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("../outside.bin", folder / "link.bin");
  const std::string text = kGltf;
  const std::size_t begin = text.find("data:");
  const auto naming = [&](const std::string& file) {
    std::string changed = text;
    return read("models/a.gltf", changed.replace(begin, text.find('"', begin) - begin, file));
  };
  const auto found = naming("below/b.bin");
  ASSERT_TRUE(found.ok()) << found.status().message();
  EXPECT_EQ(found->mesh.vertices[2], Vector3d(0, -5, 1));
  EXPECT_THAT(naming("pipe").status().message(), HasSubstr("pipe: is no regular file"));
  EXPECT_THAT(naming("below").status().message(), HasSubstr("is a folder"));
  EXPECT_FALSE(naming("/etc/passwd").ok());
  for (const char* outside : {"../outside.bin", "link.bin"})
    EXPECT_THAT(naming(outside).status().message(), HasSubstr("is outside of the model's folder")) << outside;
  // A model that is a link has its files beside what it names, as in folders made of links.
  std::filesystem::create_directory(scratch_.path() / "links");
  ASSERT_TRUE(naming("below/b.bin").ok());
  std::filesystem::create_symlink("../models/a.gltf", scratch_.path() / "links" / "a.gltf");
  std::filesystem::create_symlink("../models/below", scratch_.path() / "links" / "below");
  const auto by_links = read_mesh(scratch_.path() / "links" / "a.gltf");
  EXPECT_TRUE(by_links.ok()) << by_links.status().message();
}

TEST_F(AssimpImport, WhatIsNoRegularFileIsRefusedInEveryFormat) {
  for (const char* extension : {".ply", ".obj", ".stl", ".gltf", ".glb", ".dae"}) {
    const std::filesystem::path pipe = scratch_.path() / (std::string("pipe") + extension);
    const std::filesystem::path folder = scratch_.path() / (std::string("folder") + extension);
    const std::filesystem::path device = scratch_.path() / (std::string("device") + extension);
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    ASSERT_TRUE(std::filesystem::create_directory(folder));
    std::filesystem::create_symlink("/dev/zero", device);
    EXPECT_THAT(read_mesh(pipe).status().message(), HasSubstr("is no regular file"));
    EXPECT_THAT(read_mesh(device).status().message(), HasSubstr("is no regular file"));
    EXPECT_THAT(read_mesh(folder).status().message(), HasSubstr("is a folder"));
  }
}

TEST_F(AssimpImport, KnowsTheExtensions) {
  EXPECT_THAT(read("a.step", "").status().message(), HasSubstr("extension '.step' cannot be read; use .ply"));
  EXPECT_EQ(read_mesh(scratch_.path() / "none.PLY").status().code(), StatusCode::kNotFound);
  EXPECT_EQ(mesh_format("a/b.Stl"), MeshFormat::kStl);
  EXPECT_EQ(mesh_format("ply"), std::nullopt);
}

}  // namespace
}  // namespace prescene::interfaces
