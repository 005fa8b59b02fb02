// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "prescene/geometry/camera.h"
#include "prescene/geometry/image.h"
#include "prescene/geometry/level_camera.h"
#include "prescene/geometry/pixel_rays.h"
#include "tests/support/generators.h"
#include "tests/support/matchers.h"

namespace prescene::geometry {
namespace {

using testing::HasSubstr;
using tests::is_near;

const PinholeCamera kCamera{640, 480, 1066.778, 1067.487, 312.9869, 241.3109};

TEST(PinholeCamera, ProjectsAlongTheAxes) {
  EXPECT_THAT(kCamera.project({0.0, 0.0, 2.0}), is_near(Eigen::Vector2d(312.9869, 241.3109), 1e-12));
  // x is right, y is down.
  EXPECT_THAT(kCamera.project({0.1, 0.2, 2.0}),
              is_near(Eigen::Vector2d(312.9869 + 53.3389, 241.3109 + 106.7487), 1e-9));
}

TEST(PinholeCamera, UnprojectingIsTheInverse) {
  EXPECT_TRUE(tests::check_law([] {
    const double u = *tests::numbers(0.0, 640.0);
    const double v = *tests::numbers(0.0, 480.0);
    const double depth = *tests::numbers(0.1, 5.0);
    const Vector3d p_CQ = kCamera.unproject(u, v, depth);
    RC_ASSERT(p_CQ.z() == depth);
    RC_ASSERT((kCamera.project(p_CQ) - Eigen::Vector2d(u, v)).norm() < 1e-10);
  }));
}

TEST(LevelCamera, LooksAlongX) {
  Matrix3d R_WC;  // its x to the right (-y), its y down, its z ahead
  R_WC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  EXPECT_EQ(level_camera(Vector3d::UnitX()), R_WC);
}

TEST(LevelCamera, IsARotationWithALevelXAndYDown) {
  EXPECT_TRUE(tests::check_law([] {
    const double azimuth = *tests::numbers(-3.14, 3.14), elevation = *tests::numbers(-1.5, 1.5);
    const Vector3d forward(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                           std::sin(elevation));
    const Matrix3d R_WC = level_camera(forward);
    RC_ASSERT((R_WC.transpose() * R_WC - Matrix3d::Identity()).norm() < 1e-12);
    RC_ASSERT(R_WC.determinant() > 0.0);
    RC_ASSERT(R_WC.col(2) == forward);
    RC_ASSERT(R_WC(2, 0) == 0.0);
    RC_ASSERT(R_WC(2, 1) < 0.0);
  }));
}

TEST(PinholeCamera, RaysOfAllPixelsHaveTheBitsOfUnprojecting) {
  const PixelRays rays(kCamera);
  for (int y = 0; y < kCamera.height; y += 7)
    for (int x = 0; x < kCamera.width; ++x)
      for (const double depth : {1.0, 0.73}) ASSERT_EQ(rays.unproject(x, y, depth), kCamera.unproject(x, y, depth));
}

TEST(PinholeCamera, SubsampledPixelsLookAlongTheOriginalOnes) {
  for (const int step : {1, 3, 8}) {
    for (const int offset : {0, 2}) {
      const PinholeCamera small = kCamera.subsampled(step, offset);
      EXPECT_LE(offset + step * (small.width - 1), 639);
      EXPECT_GT(offset + step * small.width, 639);
      EXPECT_LE(offset + step * (small.height - 1), 479);
      EXPECT_GT(offset + step * small.height, 479);
      EXPECT_THAT(small.unproject(7, 11, 1.3),
                  is_near(kCamera.unproject(offset + step * 7, offset + step * 11, 1.3), 1e-12));
    }
  }
}

TEST(PinholeCamera, ValidationNamesTheField) {
  EXPECT_TRUE(validate(kCamera).ok());
  const auto message_with = [](auto change) {
    PinholeCamera camera = kCamera;
    change(camera);
    const core::Status status = validate(camera);
    EXPECT_EQ(status.code(), core::StatusCode::kInvalidInput);
    return status.message();
  };
  EXPECT_THAT(message_with([](PinholeCamera& c) { c.width = 0; }), HasSubstr("width is 0"));
  EXPECT_THAT(message_with([](PinholeCamera& c) { c.height = 16385; }), HasSubstr("height is 16385"));
  EXPECT_THAT(message_with([](PinholeCamera& c) { c.fx = -1.0; }), HasSubstr("fx"));
  EXPECT_THAT(message_with([](PinholeCamera& c) { c.fy = std::nan(""); }), HasSubstr("fy"));
  EXPECT_THAT(message_with([](PinholeCamera& c) { c.cx = std::numeric_limits<double>::infinity(); }), HasSubstr("cx"));
  EXPECT_THAT(message_with([](PinholeCamera& c) { c.cy = std::nan(""); }), HasSubstr("cy"));
}

TEST(PinholeCamera, WhatNoSensorHasIsRefusedWithItsValue) {
  EXPECT_TRUE(validate_sensor(kCamera).ok());
  for (const double value : {1e300, 1e-300, 1e6, 0.5}) {
    for (double PinholeCamera::*field : {&PinholeCamera::fx, &PinholeCamera::fy}) {
      PinholeCamera camera = kCamera;
      camera.*field = value;
      EXPECT_TRUE(validate(camera).ok()) << "close-ups may have it";
      EXPECT_EQ(validate_sensor(camera).code(), core::StatusCode::kInvalidInput) << value;
    }
  }
  for (double PinholeCamera::*field : {&PinholeCamera::cx, &PinholeCamera::cy}) {
    for (const double value : {-1e300, 2e5}) {
      PinholeCamera camera = kCamera;
      camera.*field = value;
      EXPECT_EQ(validate_sensor(camera).code(), core::StatusCode::kInvalidInput) << value;
    }
  }
  PinholeCamera camera = kCamera;
  camera.fy = 1e300;
  EXPECT_THAT(validate_sensor(camera).message(), HasSubstr("camera fy is 1e+300: "));
}

TEST(PinholeCamera, ValidationGivesTheFirstFieldTheBoundsOfItsKind) {
  // Who follows a remedy is not sent on to a narrower one, nor to a later field first.
  PinholeCamera camera = kCamera;
  camera.fx = -1.0;
  camera.cy = std::nan("");
  EXPECT_EQ(validate(camera).message(), "camera fx is -1: give a positive focal length in pixels");
  EXPECT_EQ(validate_sensor(camera).message(),
            "camera fx is -1: no camera has that; give the focal length in pixels, from 1 to 1e5");
  camera.fx = 0.5;
  EXPECT_THAT(validate(camera).message(), HasSubstr("camera cy is nan: give a finite"));
  EXPECT_THAT(validate_sensor(camera).message(), HasSubstr("camera fx is 0.5: no camera has that"));
}

TEST(Image, RowsLieOneAfterTheOther) {
  Image<int> image(3, 2, 5);
  image(2, 1) = 7;
  image(0, 1) = 6;
  EXPECT_EQ(image.size(), 6U);
  EXPECT_EQ(std::vector<int>(image.data(), image.data() + 6), (std::vector<int>{5, 5, 5, 6, 5, 7}));
  EXPECT_EQ(image, image);
  EXPECT_NE(image, (Image<int>(3, 2, 5)));
  EXPECT_NE((Image<int>(3, 2)), (Image<int>(2, 3)));
  EXPECT_TRUE(Image<int>().empty());
}

TEST(ImageView, StepsOverThePaddingOfRows) {
  std::vector<int> memory = {1, 2, -1, 3, 4, -1};
  const ImageView<int> view(memory.data(), 2, 2, 3);
  EXPECT_EQ(view(0, 1), 3);
  EXPECT_EQ(view.row(1)[1], 4);
  view(1, 0) = 9;
  EXPECT_EQ(memory[1], 9);
  const ImageView<const int> constant = view;
  EXPECT_EQ(constant(1, 0), 9);
  EXPECT_EQ(constant.stride(), 3);
  EXPECT_TRUE(ImageView<int>().empty());
}

#if defined(PRESCENE_DCHECKS) && PRESCENE_DCHECKS
TEST(ImageViewDeathTest, ChecksItsBoundsInCheckedBuilds) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  Image<int> image(3, 2);
  EXPECT_DEATH(image(3, 0), "check failed");
  EXPECT_DEATH(image(0, -1), "check failed");
}
#endif

}  // namespace
}  // namespace prescene::geometry
