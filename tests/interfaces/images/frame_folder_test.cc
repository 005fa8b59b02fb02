// SPDX-License-Identifier: Apache-2.0
#include "prescene/interfaces/images/frame_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/images/jpeg.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::PinholeCamera;
using testing::HasSubstr;
namespace fs = std::filesystem;

constexpr const char* kColumns = "frame,color,depth,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,m30,m31,m32,m33";
constexpr const char* kTurned = "0,-1,0,0.5,1,0,0,-0.25,0,0,1,2,0,0,0,1";

class FrameFolders : public testing::Test {
 protected:
  FrameFolders() {
    add_images("a", 8, 6);
    add_images("b", 8, 6);
    add_text("intrinsics.K.txt", "10 0 3.5\n0 11 2.5\n0 0 1\n");
    write_poses({"a,a.color.png,a.depth.png,1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1",
                 std::string("b,b.color.png,b.depth.png,") + kTurned});
  }

  void add_images(const std::string& name, int width, int height) const {
    const geometry::ColorImage color(width, height, {9, 8, 7});
    const geometry::DepthImage depth(width, height, 1.25F);
    ASSERT_TRUE(write_png(folder_ / (name + ".color.png"), color.view()).ok());
    ASSERT_TRUE(write_png_depth(folder_ / (name + ".depth.png"), depth.view(), 0.001).ok());
  }
  void add_text(const std::string& name, const std::string& text) const {
    ASSERT_TRUE(write_file(folder_ / name, std::string_view(text)).ok());
  }
  void write_poses(const std::vector<std::string>& rows, const std::string& columns = kColumns) const {
    std::string text = columns + "\r\n";
    for (const std::string& row : rows) text += row + "\n";
    add_text("camera_poses.csv", text);
  }
  std::string message(const FrameFolderOptions& options = {}) const {
    return FrameFolder::open(folder_, options).status().message();
  }

  tests::ScratchDir scratch_;
  fs::path folder_ = scratch_.path();
};

TEST_F(FrameFolders, ListFramesWithPosesStampsAndImages) {
  const auto opened = FrameFolder::open(folder_, {.frames_per_second = 4.0, .first_stamp_ns = 7});
  ASSERT_TRUE(opened.ok()) << opened.status().message();
  EXPECT_EQ(opened->camera(), (PinholeCamera{8, 6, 10.0, 11.0, 3.5, 2.5}));
  ASSERT_EQ(opened->frames().size(), 2U);
  const FolderFrame& b = opened->frames()[1];
  EXPECT_EQ(b.name, "b");
  EXPECT_EQ(b.stamp_ns, 250'000'007);
  EXPECT_EQ(b.X_WC.translation, geometry::Vector3d(0.5, -0.25, 2.0));
  EXPECT_TRUE((b.X_WC * geometry::Vector3d(1, 0, 0)).isApprox(geometry::Vector3d(0.5, 0.75, 2.0), 1e-12));
  const auto images = opened->load(1);
  ASSERT_TRUE(images.ok()) << images.status().message();
  EXPECT_EQ(images->color(3, 3), (geometry::Rgb{9, 8, 7}));
  EXPECT_FLOAT_EQ(images->depth(3, 3), 1.25F);
}

TEST_F(FrameFolders, TakeStampsFromTheFile) {
  const std::string columns = std::string(kColumns) + ",stamp_ns";
  const std::string a = std::string("a,a.color.png,a.depth.png,") + kTurned;
  write_poses({a + ",100", a + ",200"}, columns);
  EXPECT_EQ(FrameFolder::open(folder_)->frames()[1].stamp_ns, 200);
  write_poses({a + ",100", a + ",100"}, columns);
  EXPECT_THAT(message(), HasSubstr("camera_poses.csv: line 3: stamp 100 ns is not after"));
  write_poses({a + ",1e3"}, columns);
  EXPECT_THAT(message(), HasSubstr("line 2: stamp_ns '1e3' is no whole number"));
}

TEST_F(FrameFolders, NameFileLineAndRemedy) {
  const std::string start = "a,a.color.png,a.depth.png,";
  write_poses({start + "1,0,0,0,0,1,0,nan,0,0,1,0,0,0,0,1"});
  EXPECT_THAT(message(), HasSubstr("camera_poses.csv: line 2: the pose has NaN or infinity"));
  write_poses({start + "1,0,0,0,0,1,0,0,0,0,1.01,0,0,0,0,1"});
  EXPECT_THAT(message(), HasSubstr("line 2: the pose is not rigid"));
  write_poses({start + "1,0,0,0,0,1,0,0,0,0,-1,0,0,0,0,1"});
  EXPECT_THAT(message(), HasSubstr("determinant -1"));
  write_poses({start + "1,0,0,0,0,1,0,0,0,0,1,0,0.5,0,0,1"});
  EXPECT_THAT(message(), HasSubstr("last row 0 0 0 1"));
  write_poses({start + "1,0,0,x,0,1,0,0,0,0,1,0,0,0,0,1"});
  EXPECT_THAT(message(), HasSubstr("line 2: m03 'x' is no number"));
  write_poses({"", start + "1"});
  EXPECT_THAT(message(), HasSubstr("line 3: has 4 cells, the first line has 19"));
  write_poses({std::string("a,../a.color.png,a.depth.png,") + kTurned});
  EXPECT_THAT(message(), HasSubstr("line 2: the file name '../a.color.png' does not lie in the folder"));
  write_poses({std::string("a,/etc/passwd,a.depth.png,") + kTurned});
  EXPECT_THAT(message(), HasSubstr("does not lie in the folder"));
  write_poses({std::string("c,c.color.png,a.depth.png,") + kTurned});
  EXPECT_THAT(message(), HasSubstr("c.color.png: is missing for frame c"));
  write_poses({}, "frame,color,depth,m00");
  EXPECT_THAT(message(), HasSubstr("line 1: the columns m01, m02"));
  write_poses({}, std::string(kColumns) + ",m00");
  EXPECT_THAT(message(), HasSubstr("column 'm00' stands twice"));
  write_poses({});
  EXPECT_THAT(message(), HasSubstr("there is no frame"));
}

TEST_F(FrameFolders, CheckTheCamera) {
  add_text("intrinsics.K.txt", "10 0 3.5\n0 x 2.5\n0 0 1\n");
  EXPECT_THAT(message(), HasSubstr("intrinsics.K.txt: line 2: 'x' is no finite number"));
  add_text("intrinsics.K.txt", "10 0 3.5\n0 11 2.5\n");
  EXPECT_THAT(message(), HasSubstr("line 3: a 3x3 matrix has three lines"));
  add_text("intrinsics.K.txt", "10 0 0\n0 11 0\n3.5 2.5 1\n");
  EXPECT_THAT(message(), HasSubstr("only fx, fy, cx and cy may be set"));
  add_text("intrinsics.K.txt", "-10 0 3.5\n0 11 2.5\n0 0 1\n");
  EXPECT_THAT(message(), HasSubstr("intrinsics.K.txt: "));
  fs::remove(folder_ / "intrinsics.K.txt");
  EXPECT_THAT(message(),
              HasSubstr("there is no intrinsics.K.txt; put the 3x3 camera matrix there, or give the camera"));
  EXPECT_EQ(message({.camera = PinholeCamera{8, 6, 10, 10, 4, 3}}), "");
  EXPECT_THAT(message({.camera = PinholeCamera{9, 6, 10, 10, 4, 3}}),
              HasSubstr("has 8 x 6 pixels, but the camera given"));
}

TEST_F(FrameFolders, SayWhichImageHasAnotherSizeOrIsBroken) {
  add_images("b", 8, 7);
  auto opened = FrameFolder::open(folder_);
  ASSERT_TRUE(opened.ok());
  EXPECT_TRUE(opened->load(0).ok());
  EXPECT_THAT(opened->load(1).status().message(), HasSubstr("b.color.png: has 8 x 7 pixels, but the camera has 8 x 6"));
  fs::copy_file(folder_ / "a.color.png", folder_ / "b.depth.png", fs::copy_options::overwrite_existing);
  EXPECT_THAT(opened->load(1).status().message(), HasSubstr("b.depth.png: is 8-bit colour, but depth needs"));
  fs::resize_file(folder_ / "a.color.png", 60);
  EXPECT_THAT(opened->load(0).status().message(), HasSubstr("a.color.png: is cut"));
}

TEST_F(FrameFolders, TakeColourAsJpegToo) {
  ASSERT_TRUE(write_file(folder_ / "b.jpg", encode_jpeg(geometry::ColorImage(8, 6, {9, 8, 7}).view())).ok());
  write_poses({std::string("b,b.jpg,b.depth.png,") + kTurned});
  const auto opened = FrameFolder::open(folder_);
  ASSERT_TRUE(opened.ok()) << opened.status().message();
  const auto images = opened->load(0);
  ASSERT_TRUE(images.ok()) << images.status().message();
  for (const int channel : {0, 1, 2})
    EXPECT_NEAR(images->color(4, 3)[static_cast<std::size_t>(channel)], 9 - channel, 3);
}

TEST_F(FrameFolders, WorkWithoutPoses) {
  fs::remove(folder_ / "camera_poses.csv");
  const auto opened = FrameFolder::open(folder_);
  ASSERT_TRUE(opened.ok()) << opened.status().message();
  ASSERT_EQ(opened->frames().size(), 2U);
  EXPECT_EQ(opened->frames()[1].name, "b");
  EXPECT_EQ(opened->frames()[1].X_WC, geometry::Pose::identity());
  fs::remove(folder_ / "b.depth.png");
  EXPECT_THAT(message(), HasSubstr("b.depth.png: is missing"));
  fs::remove(folder_ / "b.color.png");
  EXPECT_EQ(message(), "");
  fs::remove(folder_ / "a.color.png");
  EXPECT_THAT(message(), HasSubstr("a.color.png: is missing for frame a")) << "not left out in silence";
}

TEST_F(FrameFolders, WhatCannotBeReadIsNotTakenForMissing) {
  const fs::path poses = folder_ / "camera_poses.csv";
  const fs::path intrinsics = folder_ / "intrinsics.K.txt";
  const fs::path frames = folder_ / "frames";
  const FrameFolderOptions with_camera{.camera = PinholeCamera{8, 6, 10, 10, 4, 3}};
  // Not a camera that stands still: a link to itself, and one that leads nowhere.
  fs::remove(poses);
  fs::create_symlink(poses.filename(), poses);
  EXPECT_THAT(message(), HasSubstr("camera_poses.csv: cannot be opened"));
  fs::remove(poses);
  fs::create_symlink("nowhere.csv", poses);
  EXPECT_THAT(message(), HasSubstr("camera_poses.csv: no such file"));
  fs::remove(poses);
  // Nor another camera, nor the frames beside.
  fs::remove(intrinsics);
  fs::create_symlink(intrinsics.filename(), intrinsics);
  EXPECT_THAT(message(with_camera), HasSubstr("intrinsics.K.txt: cannot be opened"));
  fs::remove(intrinsics);
  EXPECT_EQ(message(with_camera), "");
  fs::create_symlink(frames.filename(), frames);
  EXPECT_THAT(message(with_camera), HasSubstr("frames: cannot be looked at"));
}

TEST_F(FrameFolders, HoldASingleFrame) {
  const fs::path single = folder_ / "single";
  fs::create_directory(single);
  EXPECT_THAT(FrameFolder::open(single).status().message(), HasSubstr("has no frames; put camera_poses.csv"));
  fs::copy_file(folder_ / "a.color.png", single / "color.png");
  fs::copy_file(folder_ / "a.depth.png", single / "depth.png");
  const auto opened = FrameFolder::open(single, {.camera = PinholeCamera{8, 6, 10, 10, 4, 3}});
  ASSERT_TRUE(opened.ok()) << opened.status().message();
  EXPECT_EQ(opened->frames().at(0).name, "single");
  EXPECT_TRUE(opened->load(0).ok());
  EXPECT_EQ(FrameFolder::open(folder_ / "nowhere").status().code(), StatusCode::kNotFound);
}

TEST(RealFrameFolders, TheRecordedSequence) {
  const auto folder = tests::data_dir("rgbd_sequence");
  if (!folder) GTEST_SKIP() << tests::missing_data_message("rgbd_sequence");
  const auto opened = FrameFolder::open(*folder);
  ASSERT_TRUE(opened.ok()) << opened.status().message();
  EXPECT_EQ(opened->frames().size(), 24U);
  EXPECT_NEAR(opened->camera().fx, 615.1952, 1e-4);
  // Its README: 36 % of the depth is measured, median 0.40 m (of all 50 frames of the source); we look at every eighth.
  double measured = 0.0;
  std::vector<float> depths;
  for (std::size_t i = 0; i < 24; i += 8) {
    const auto images = opened->load(i);
    ASSERT_TRUE(images.ok()) << images.status().message();
    for (std::size_t p = 0; p < images->depth.size(); ++p) {
      if (images->depth.data()[p] > 0.0F) depths.push_back(images->depth.data()[p]);
    }
    measured += static_cast<double>(images->depth.size());
  }
  EXPECT_NEAR(static_cast<double>(depths.size()) / measured, 0.36, 0.08);
  std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2), depths.end());
  EXPECT_NEAR(static_cast<double>(depths[depths.size() / 2]), 0.40, 0.08);
}

}  // namespace
}  // namespace prescene::interfaces
