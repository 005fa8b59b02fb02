// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "decode_text.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::TriangleMesh;
using geometry::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kHead =
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\n";
constexpr const char* kFaces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
constexpr const char* kCorners = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

std::string text_of(const std::string& faces_header, const std::string& body) { return kHead + faces_header + body; }

TEST(Ply, CutsPolygonsIntoFans) {
  const auto mesh = decode_text(MeshFormat::kPly, text_of(kFaces, std::string(kCorners) + "4 0 1 2 3\n"));
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  EXPECT_EQ(mesh->mesh.vertices.size(), 4U);
  EXPECT_THAT(mesh->mesh.triangles,
              ElementsAre(std::array<std::uint32_t, 3>{0, 1, 2}, std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_TRUE(mesh->warnings.empty()) << mesh->warnings[0];
}

TEST(Ply, PassesOverWhatItDoesNotKnow) {
  const std::string text =
      "ply\r\nformat ascii 1.0\r\nobj_info x\r\n"
      "element camera 1\r\nproperty float view\r\nproperty list uchar float more\r\n"
      "element vertex 3\r\nproperty float nx\r\nproperty double x\r\nproperty list int int extra\r\nproperty int y\r\n"
      "property float z\r\n"
      "element face 1\r\nproperty uchar flags\r\nproperty list int uint vertex_index\r\nproperty list uchar float "
      "uv\r\n"
      "element nothing 4000000000\r\n"
      "end_header\r\n"
      "0.5 2 7 8\r\n"
      "9 0.25 0 0 0\r\n9 1 2 4 5 0 0\r\n9 0 1 6 1 0\r\n"
      "255 3 0 1 2 0\r\n";
  const auto mesh = decode_text(MeshFormat::kPly, text);
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  EXPECT_EQ(mesh->mesh.vertices[0], Vector3d(0.25, 0, 0));
  EXPECT_EQ(mesh->mesh.vertices[2], Vector3d(0, 1, 0));
  EXPECT_EQ(mesh->mesh.triangles.size(), 1U);
}

template <class T>
void append(std::string* out, T value, bool big) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i) *out += raw[big ? sizeof(T) - 1 - i : i];
}

TEST(Ply, ReadsBothBinaryByteOrders) {
  for (const bool big : {false, true}) {
    std::string text = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                       "_endian 1.0\nelement vertex 3\nproperty float x\nproperty double y\nproperty short z\n"
                       "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                       "element face 1\nproperty list ushort uint vertex_indices\nend_header\n";
    for (int i = 0; i < 3; ++i) {
      append(&text, static_cast<float>(i) * 0.5F, big);
      append(&text, i == 1 ? 0.125 : -0.25, big);
      append(&text, static_cast<std::int16_t>(i * i), big);
      text += {static_cast<char>(i), static_cast<char>(10 + i), static_cast<char>(200 + i)};
    }
    append(&text, std::uint16_t{3}, big);
    for (const std::uint32_t index : {2U, 0U, 1U}) append(&text, index, big);
    const auto mesh = decode_text(MeshFormat::kPly, text);
    ASSERT_TRUE(mesh.ok()) << mesh.status().message();
    EXPECT_EQ(mesh->mesh.vertices[2], Vector3d(1.0, -0.25, 4.0));
    EXPECT_THAT(mesh->mesh.triangles, ElementsAre(std::array<std::uint32_t, 3>{2, 0, 1}));
    EXPECT_THAT(mesh->colors,
                ElementsAre(geometry::Rgb{0, 10, 200}, geometry::Rgb{1, 11, 201}, geometry::Rgb{2, 12, 202}));
    for (std::size_t length = 0; length < text.size(); ++length) {
      const auto cut = decode_text(MeshFormat::kPly, std::string_view(text).substr(0, length)).status();
      EXPECT_FALSE(cut.ok()) << length;
    }
  }
}

TEST(Ply, NamesLineAndRemedy) {
  const auto message = [](const std::string& text) { return error_of(MeshFormat::kPly, text); };
  EXPECT_THAT(message("solid x\n"), HasSubstr("does not begin with a line \"ply\""));
  EXPECT_THAT(message("ply\nformat ascii 1.0\n"), HasSubstr("line 3: ends before end_header"));
  EXPECT_THAT(message("ply\nformat xml 1.0\n"), HasSubstr("line 2: the format 'xml' is unknown"));
  EXPECT_THAT(message("ply\nproperty float x\n"), HasSubstr("line 2: a property stands before the first element"));
  EXPECT_THAT(message("ply\nelement vertex -3\n"), HasSubstr("line 2: the element 'vertex' has no count"));
  EXPECT_THAT(message("ply\nelement vertex 3\nproperty real x\n"), HasSubstr("line 3: 'real' is no type"));
  EXPECT_THAT(message("ply\nelement face 3\nproperty list float int i\n"),
              HasSubstr("is no type for the length of a list"));
  EXPECT_THAT(message("ply\nelement vertex 0\nend_header\n"), HasSubstr("there is no line with the format"));
  EXPECT_THAT(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
              HasSubstr("no properties x, y and z"));
  EXPECT_THAT(message(text_of(kFaces, "0 0 0\n1 0 0\n1 1 zero\n0 1 0\n3 0 1 2\n")),
              HasSubstr("line 13: 'zero' is no number"));
  EXPECT_THAT(message(text_of(kFaces, std::string(kCorners) + "3 0 1 4\n")),
              HasSubstr("line 15: a face names vertex 4 of 4 (counted from 0)"));
  EXPECT_THAT(message(text_of(kFaces, std::string(kCorners) + "3 0 -1 2\n")), HasSubstr("a face names vertex -1 of 4"));
  EXPECT_THAT(message(text_of(kFaces, std::string(kCorners) + "-3 0 1 2\n")), HasSubstr("a list has the length -3"));
  EXPECT_THAT(message(text_of(kFaces, std::string(kCorners) + "3 0 1\n")), HasSubstr("the file ends before all"));
  EXPECT_THAT(message(text_of("element face 0\nproperty list uchar int vertex_indices\nend_header\n", kCorners)),
              HasSubstr("has no triangles (4 vertices); export a surface, not a point cloud"));
  EXPECT_THAT(message(text_of("element tristrips 1\nproperty list int int vertex_indices\nend_header\n",
                              std::string(kCorners) + "3 0 1 2\n")),
              HasSubstr("triangle strips"));
}

/// The colours would be those of the first element only, and the faces' indices could mean either.
TEST(Ply, RefusesASecondElementOfVerticesOrFaces) {
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string body = "9 9 9 255 0 0\n" + std::string(kCorners) + "3 0 1 2\n";
  EXPECT_THAT(error_of(MeshFormat::kPly, "ply\nformat ascii 1.0\nelement vertex 1\n" + xyz + colors +
                                             "element vertex 4\n" + xyz + faces + "end_header\n" + body),
              HasSubstr("line 10: a second element 'vertex'; only one is read: merge the parts"));
  EXPECT_THAT(error_of(MeshFormat::kPly, text_of(faces + faces + "end_header\n", kCorners)),
              HasSubstr("line 10: a second element 'face'; only one is read"));
}

TEST(Ply, ATextureCountsAsUnread) {
  const auto is_unread = [](const std::string& comment) {
    return decode_text(MeshFormat::kPly, "ply\nformat ascii 1.0\n" + comment +
                                             "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                                             "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                                             "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        ->unread_look;
  };
  EXPECT_FALSE(is_unread(""));
  EXPECT_FALSE(is_unread("comment made by hand\n"));
  EXPECT_TRUE(is_unread("comment TextureFile can.png\n"));
}

core::Result<LoadedMesh> mesh_with_colors(const std::string& type, const std::string& color) {
  const std::string header = "property " + type + " red\nproperty " + type + " green\nproperty " + type + " blue\n";
  return decode_text(MeshFormat::kPly,
                     "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n" +
                         header + kFaces + "0 0 0 " + color + "\n1 0 0 " + color + "\n0 1 0 " + color + "\n3 0 1 2\n");
}

TEST(Ply, ScalesColoursByTheRangeOfTheirType) {
  for (const auto& [type, color] :
       {std::pair{"uchar", "0 51 255"}, std::pair{"int", "0 51 255"}, std::pair{"ushort", "0 13107 65535"},
        std::pair{"float", "0 0.2 1"}, std::pair{"double", "-0.001 0.2 1.004"}}) {
    const auto mesh = mesh_with_colors(type, color);
    ASSERT_TRUE(mesh.ok()) << type << ": " << mesh.status().message();
    EXPECT_EQ(mesh->colors.at(0), (geometry::Rgb{0, 51, 255})) << type;
    EXPECT_TRUE(mesh->warnings.empty()) << mesh->warnings[0];
  }
  EXPECT_THAT(mesh_with_colors("ushort", "0 51 255")->warnings, ElementsAre(HasSubstr("none is above 255")));
}

TEST(Ply, RefusesColoursThatTheirTypeDoesNotMean) {
  for (const auto& [type, color] :
       {std::pair{"float", "128 128 128"}, std::pair{"double", "1 1 1.5"}, std::pair{"int", "256 0 0"},
        std::pair{"short", "-1000 0 0"}, std::pair{"float", "nan 0 0"}}) {
    const auto mesh = mesh_with_colors(type, color);
    ASSERT_FALSE(mesh.ok()) << type;
    EXPECT_THAT(mesh.status().message(), HasSubstr("line 13: a colour of ")) << type;
    EXPECT_THAT(mesh.status().message(), HasSubstr("save them as uchar, 0 to 255")) << type;
  }
}

TEST(Ply, TakesNoMemoryForCountsThatTheFileCannotHold) {
  const auto message =
      error_of(MeshFormat::kPly,
               "ply\nformat binary_little_endian 1.0\nelement vertex 9000000\nproperty float x\nproperty float "
               "y\nproperty float z\nend_header\n");
  EXPECT_THAT(message, HasSubstr("the header names 9000000 of 'vertex', more than the rest of the file can hold"));
  EXPECT_EQ(decode_text(MeshFormat::kPly, text_of(kFaces, std::string(kCorners) + "4 0 1 2 3\n"), {.max_triangles = 1})
                .status()
                .code(),
            StatusCode::kResourceExhausted);
}

TEST(Ply, ReportsVerticesThatAreNotFinite) {
  const std::string two_faces = "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
  const auto mesh =
      decode_text(MeshFormat::kPly, text_of(two_faces, "0 0 0\n1 0 0\n1 1 0\n0 nan 0\n3 0 1 2\n3 0 2 3\n"));
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  EXPECT_EQ(mesh->mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh->repair.non_finite_vertices, 1);
  EXPECT_THAT(mesh->warnings.at(0), HasSubstr("vertex 3 (line 14) is the first that is not finite"));
  EXPECT_THAT(error_of(MeshFormat::kPly, text_of(kFaces, "inf 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n")),
              HasSubstr("vertex 0 (line 11)"));
}

TEST(Ply, KeepsColoursThroughRepair) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nproperty float "
      "red\n"
      "property float green\nproperty float blue\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const auto mesh = decode_text(MeshFormat::kPly,
                                head + "9 9 9 0 0 0\n0 0 0 1 0 0\n1 0 0 0 0.5 0\n0 0 0 0 0 1\n0 1 0 0 0 1\n3 1 2 4\n");
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  ASSERT_EQ(mesh->mesh.vertices.size(), 3U);
  ASSERT_EQ(mesh->colors.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d& p = mesh->mesh.vertices[i];
    const geometry::Rgb expected = p.x() > 0.5   ? geometry::Rgb{0, 128, 0}
                                   : p.y() > 0.5 ? geometry::Rgb{0, 0, 255}
                                                 : geometry::Rgb{255, 0, 0};
    EXPECT_EQ(mesh->colors[i], expected) << i;
  }
}

}  // namespace
}  // namespace prescene::interfaces
