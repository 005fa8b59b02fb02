// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decode_text.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::Vector3d;
using testing::HasSubstr;

constexpr const char* kFacet =
    "facet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\n";

std::string binary(std::uint32_t count, std::size_t triangles, const std::string& header = "made by hand") {
  std::string out = header;
  out.resize(80);
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(count >> shift & 0xff);
  for (std::size_t t = 0; t < triangles; ++t) {
    std::string triangle(50, '\0');
    triangle[24 + 2] = '\x80';  // Second corner x = 1: 0x3f800000.
    triangle[24 + 3] = '\x3f';
    triangle[36 + 6] = '\x80';  // Third corner y = 1.
    triangle[36 + 7] = '\x3f';
    out += triangle;
  }
  return out;
}

TEST(Stl, ReadsText) {
  const auto mesh = decode_text(
      MeshFormat::kStl, std::string("solid a cup of tea\n") + kFacet + "endsolid\nsolid b\nFACET NORMAL 0 0 1\n" +
                            "OUTER LOOP VERTEX 0 0 1 VERTEX 1e0 0 1 VERTEX 0 +1 1\nENDLOOP ENDFACET ENDSOLID b\n");
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  EXPECT_EQ(mesh->mesh.triangles.size(), 2U);
  EXPECT_EQ(mesh->mesh.vertices.size(), 6U);
  EXPECT_EQ(mesh->mesh.vertices[4], Vector3d(1, 0, 1));
}

TEST(Stl, ReadsBinaryEvenWhenItsHeaderSaysSolid) {
  for (const char* header : {"made by hand", "solid made by hand"}) {
    const auto mesh = decode_text(MeshFormat::kStl, binary(1, 1, header));
    ASSERT_TRUE(mesh.ok()) << mesh.status().message();
    EXPECT_EQ(mesh->mesh.vertices[1], Vector3d(1, 0, 0));
    EXPECT_EQ(mesh->mesh.vertices[2], Vector3d(0, 1, 0));
  }
  const auto trailing = decode_text(MeshFormat::kStl, binary(1, 2));
  EXPECT_THAT(trailing->warnings.at(0), HasSubstr("50 bytes after the last triangle"));
}

TEST(Stl, EveryCutIsAnError) {
  const std::string text = std::string("solid a\n") + kFacet + kFacet + "endsolid a";
  for (std::size_t length = 0; length + 3 < text.size(); ++length) {
    EXPECT_FALSE(decode_text(MeshFormat::kStl, std::string_view(text).substr(0, length)).ok()) << length;
  }
  const std::string bytes = binary(2, 2);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto status = decode_text(MeshFormat::kStl, std::string_view(bytes).substr(0, length)).status();
    EXPECT_EQ(status.code(), StatusCode::kDataLoss) << length;
  }
}

TEST(Stl, NamesPlaceAndRemedy) {
  const auto message = [](const std::string& text) { return error_of(MeshFormat::kStl, text); };
  EXPECT_THAT(message(binary(3, 2)),
              HasSubstr("byte 80: says it has 3 triangles, but holds 2; the file is cut or no STL"));
  EXPECT_THAT(message(binary(0xffffffff, 2)), HasSubstr("says it has 4294967295 triangles"));
  EXPECT_THAT(message("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 zero\n"),
              HasSubstr("line 4: 'zero' is no number"));
  EXPECT_THAT(message("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 0\nendloop\n"),
              HasSubstr("line 6: 'endloop' instead of vertex"));
  EXPECT_THAT(message("solid\nendsolid\n"), HasSubstr("has no triangles"));
  EXPECT_THAT(message(std::string("solid\n") + kFacet + "color 1\n"),
              HasSubstr("line 9: 'color' instead of facet or endsolid"));
  EXPECT_THAT(message(""), HasSubstr("is empty"));
}

}  // namespace
}  // namespace prescene::interfaces
