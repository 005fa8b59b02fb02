// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decode_text.h"

namespace prescene::interfaces {
namespace {

using geometry::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;
using Corners = std::array<std::uint32_t, 3>;

constexpr const char* kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

TEST(Obj, ReadsEveryFormOfAFace) {
  for (const char* face : {"f 1 2 3 4", "f 1/5 2/5 3/5 4/5", "f 1//7 2//7 3//7 4//7", "f 1/1/1 2/2/2 3/3/3 4/4/4",
                           "f -4 -3 -2 -1", "  f\t1 2 \\\n 3 4 # square", "f 1 2 3 4\r"}) {
    const auto mesh =
        decode_text(MeshFormat::kObj, std::string("# a square\nmtllib a.mtl\no s\n") + kSquare +
                                          "vn 0 0 1\nvt 0 0\ng a\n" + "usemtl b\ns off\n" + face + "\nl 1 2\n");
    ASSERT_TRUE(mesh.ok()) << face << mesh.status().message();
    EXPECT_THAT(mesh->mesh.triangles, ElementsAre(Corners{0, 1, 2}, Corners{0, 2, 3})) << face;
    EXPECT_TRUE(mesh->colors.empty());
    EXPECT_TRUE(mesh->unread_look) << "its material";
  }
}

TEST(Obj, MaterialsCountAsUnreadWhereNothingElseGivesColours) {
  const std::string plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const std::string colored = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n";
  const auto is_unread = [](const std::string& text) { return decode_text(MeshFormat::kObj, text)->unread_look; };
  EXPECT_FALSE(is_unread(plain));
  EXPECT_TRUE(is_unread("mtllib a.mtl\n" + plain));
  EXPECT_TRUE(is_unread("usemtl red\n" + plain));
  EXPECT_FALSE(is_unread("# mtllib a.mtl\n" + plain));
  EXPECT_FALSE(is_unread("mtllib a.mtl\n" + colored));
}

TEST(Obj, AcceptsFacesBeforeTheirVertices) {
  EXPECT_TRUE(decode_text(MeshFormat::kObj, std::string("f 1 2 3\n") + kSquare).ok());
}

TEST(Obj, ReadsColours) {
  const auto mesh = decode_text(MeshFormat::kObj, "v 0 0 0 1 0 0\nv 1 0 0 1.0 0 0.5 0\nv 0 1 0\nf 1 2 3");
  ASSERT_TRUE(mesh.ok()) << mesh.status().message();
  EXPECT_THAT(mesh->colors,
              ElementsAre(geometry::Rgb{255, 0, 0}, geometry::Rgb{0, 128, 0}, geometry::Rgb{255, 255, 255}));
}

TEST(Obj, NamesLineAndRemedy) {
  const auto message = [](const std::string& text) { return error_of(MeshFormat::kObj, text); };
  EXPECT_THAT(message("v 0 0\n"), HasSubstr("line 1: a vertex needs three numbers, here are 2"));
  EXPECT_THAT(message("\nv 0 0 O\n"), HasSubstr("line 2: 'O' is no number"));
  EXPECT_THAT(message("v 1 2 3 4 5 6 7 8"), HasSubstr("at most seven numbers"));
  EXPECT_THAT(message(std::string(kSquare) + "f 0 1 2\n"),
              HasSubstr("line 5: '0' is no corner of a face; vertices count from 1"));
  EXPECT_THAT(message(std::string(kSquare) + "f 1 2 x\n"), HasSubstr("'x' is no corner"));
  EXPECT_THAT(message(std::string(kSquare) + "f -5 1 2\n"), HasSubstr("vertex -5 counted back from the last of 4"));
  EXPECT_THAT(message(std::string(kSquare) + "f 1 2 5\n"),
              HasSubstr("line 5: the face names vertex 5, but the file has 4"));
  EXPECT_THAT(message(std::string(kSquare) + "f 1 2 4294967297\n"), HasSubstr("more than the limit"));
  EXPECT_THAT(message(kSquare), HasSubstr("has no triangles (4 vertices)"));
  EXPECT_THAT(message("f 1 2\n"), HasSubstr("the face names vertex 2, but the file has 0"));
  const auto small = decode_text(MeshFormat::kObj, std::string(kSquare) + "f 1 2\nf 1 2 3\n");
  EXPECT_THAT(small->warnings.at(0), HasSubstr("1 faces with fewer than three corners"));
  EXPECT_THAT(message("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
              HasSubstr("vertex 0 (line 1) is the first that is not finite"));
}

TEST(Obj, ScaleAndUpAxisAreApplied) {
  const std::string text = "v 1 2 3\nv 4 2 3\nv 1 5 3\nf 1 2 3\n";
  const auto first = [&](const MeshReadOptions& options) {
    return decode_text(MeshFormat::kObj, text, options)->mesh.vertices[0];
  };
  EXPECT_EQ(first({}), Vector3d(1, 2, 3));
  EXPECT_EQ(first({.up_axis = UpAxis::kZ}), Vector3d(1, 2, 3));
  EXPECT_EQ(first({.metres_per_unit = 0.5, .up_axis = UpAxis::kY}), Vector3d(0.5, -1.5, 1));
  EXPECT_EQ(first({.up_axis = UpAxis::kX}), Vector3d(-3, 2, 1));
  EXPECT_THAT(error_of(MeshFormat::kObj, text, {.metres_per_unit = 0.0}),
              HasSubstr("the scale is 0; it must be positive"));
}

TEST(ScaleHint, DoubtsUnlikelySizes) {
  const auto hint = [](double length) {
    return scale_hint(geometry::Box(Vector3d::Zero(), Vector3d(0.01 * length, length, 0.1 * length)));
  };
  EXPECT_EQ(*hint(97.0),
            "the bounding box is 0.97 x 97 x 9.7 m: the mesh is probably in millimetres; set its scale to 0.001");
  EXPECT_EQ(*hint(0.0002),
            "the bounding box is 2e-06 x 0.0002 x 2e-05 m: the mesh is probably scaled by 0.001 already; set its scale "
            "to 1000");
  const geometry::Box hundred_metres(Vector3d::Zero(), Vector3d(80.0, 97.0, 60.0));
  EXPECT_EQ(*scale_hint(hundred_metres, 1000.0),
            "the bounding box is 80 x 97 x 60 m at the scale 1000: the mesh is probably in metres; set its scale to 1");
  EXPECT_EQ(
      *scale_hint(geometry::Box(Vector3d::Zero(), Vector3d::Constant(1e-4)), 0.001),
      "the bounding box is 0.0001 x 0.0001 x 0.0001 m at the scale 0.001: the mesh is probably in metres; set its "
      "scale to 1");
  EXPECT_THAT(*scale_hint(geometry::Box(Vector3d::Zero(), Vector3d::Constant(1e9))), HasSubstr("check its scale"));
  EXPECT_FALSE(hint(0.2));
  EXPECT_FALSE(hint(9.0));
  EXPECT_FALSE(scale_hint(geometry::Box()));
  const auto cup = decode_text(MeshFormat::kObj, "v 0 0 0\nv 80 0 0\nv 0 97 0\nf 1 2 3\n");
  EXPECT_THAT(cup->warnings.at(0), HasSubstr("probably in millimetres"));
}

}  // namespace
}  // namespace prescene::interfaces
