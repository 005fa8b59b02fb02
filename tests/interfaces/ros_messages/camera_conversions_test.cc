// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::PinholeCamera;
using testing::HasSubstr;

const PinholeCamera kCamera{640, 480, 600.0, 610.0, 319.5, 240.25};

std::string message_of(const RosCameraInfo& info, const CameraRules& rules = {}) {
  return to_camera(info, rules).status().message();
}

TEST(Cameras, GoThereAndBack) {
  CameraReport report;
  EXPECT_EQ(*to_camera(to_ros_camera_info(kCamera, {}), {}, &report), kCamera);
  EXPECT_EQ(*to_camera(to_ros_camera_info(kCamera, {}), {.rectified = true}, &report), kCamera);
  EXPECT_TRUE(report.warnings.empty());
  EXPECT_EQ(report.max_distortion, 0.0);
}

TEST(Cameras, ApplyRegionOfInterestAndBinning) {
  RosCameraInfo info = to_ros_camera_info(kCamera, {});
  info.binning_x = 2;
  info.binning_y = 4;
  info.roi = {20, 40, 400, 600, false};
  EXPECT_EQ(*to_camera(info), (PinholeCamera{300, 100, 300.0, 152.5, 149.75, 50.0625}));
  EXPECT_TRUE(to_camera(info, {.image_width = 300, .image_height = 100}).ok());
  EXPECT_THAT(message_of(info, {.image_width = 640, .image_height = 480}),
              HasSubstr("describes images of 300 x 100 pixels, but they have 640 x 480"));
  info.roi.x_offset = 0xffffffff;
  EXPECT_THAT(message_of(info), HasSubstr("roi: does not lie in the image"));
  info.roi = {640, 0, 0, 0, false};
  EXPECT_THAT(message_of(info), HasSubstr("roi: does not lie in the image"));
  info.roi = {};
  info.binning_x = 641;
  EXPECT_THAT(message_of(info), HasSubstr("binning: 641 x 4 leaves no pixel"));
}

TEST(Cameras, RefuseWhatIsNoCalibration) {
  RosCameraInfo info = to_ros_camera_info(kCamera, {});
  info.k.fill(0.0);
  EXPECT_THAT(message_of(info), HasSubstr("k: is zero, the camera is not calibrated"));
  for (const double bad : {-600.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    info = to_ros_camera_info(kCamera, {});
    info.k[4] = bad;
    EXPECT_THAT(message_of(info), HasSubstr("k: focal lengths 600, ")) << bad;
  }
  info = to_ros_camera_info(kCamera, {});
  info.height = 0;
  EXPECT_THAT(message_of(info), HasSubstr("width x height: is 640 x 0"));
  info.height = 0xffffffff;
  EXPECT_EQ(to_camera(info).status().code(), StatusCode::kInvalidInput);
}

TEST(Cameras, SayHowMuchDistortionIsLeftOut) {
  RosCameraInfo info = to_ros_camera_info({200, 200, 100.0, 100.0, 100.0, 100.0}, {});
  info.d = {0.1, 0.0, 0.0, 0.0, 0.0};
  CameraReport report;
  ASSERT_TRUE(to_camera(info, {}, &report).ok());
  // The corner at (-1, -1) has r^2 = 2 and moves outwards by 0.2 in x and y, 20 pixels each.
  EXPECT_NEAR(report.max_distortion, 20.0 * std::sqrt(2.0), 1e-9);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("moves the image corners by up to 28 pixels"));

  info.distortion_model = "equidistant";
  info.d = {0.0, 0.0, 0.0, 1e-9};
  ASSERT_TRUE(to_camera(info, {}, &report).ok());
  EXPECT_NEAR(report.max_distortion, 100.0 * (std::sqrt(2.0) - std::atan(std::sqrt(2.0))), 1e-5);

  info.distortion_model = "rational_polynomial";
  ASSERT_TRUE(to_camera(info, {}, &report).ok());
  EXPECT_THAT(report.warnings[0], HasSubstr("'rational_polynomial' with 4 coefficients is unknown"));
  ASSERT_TRUE(to_camera(info, {.rectified = true}, &report).ok());
  EXPECT_TRUE(report.warnings.empty()) << "rectified images have no distortion";
}

TEST(Cameras, NoticeTheRightCameraOfAPair) {
  RosCameraInfo info = to_ros_camera_info(kCamera, {});
  info.p[3] = -60.0;
  CameraReport report;
  ASSERT_TRUE(to_camera(info, {.rectified = true}, &report).ok());
  EXPECT_THAT(report.warnings.at(0), HasSubstr("0.1 m right of the left one"));
}

}  // namespace
}  // namespace prescene::interfaces
