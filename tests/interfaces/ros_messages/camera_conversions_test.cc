// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <vector>

#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::interfaces {
namespace {

using core::StatusCode;
using geometry::LensDistortion;
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
  for (const double bad : {1e300, 1e-300}) {
    info = to_ros_camera_info(kCamera, {});
    info.k[0] = info.k[4] = bad;
    EXPECT_THAT(message_of(info), HasSubstr("k: camera fx is 1e")) << bad;
    EXPECT_THAT(message_of(info), HasSubstr("give the focal length in pixels")) << bad;
  }
  info = to_ros_camera_info(kCamera, {});
  info.height = 0;
  EXPECT_THAT(message_of(info), HasSubstr("width x height: is 640 x 0"));
  info.height = 0xffffffff;
  EXPECT_EQ(to_camera(info).status().code(), StatusCode::kInvalidInput);
}

TEST(Cameras, HaveTheLensOfTheirModel) {
  RosCameraInfo info = to_ros_camera_info(kCamera, {});
  EXPECT_TRUE(to_lens(info)->is_none()) << "all of D is zero";
  const std::vector<double> d = {-0.3, 0.1, 0.001, -0.002, 0.05, 0.2, -0.1, 0.03};
  CameraReport report;
  for (const char* model : {"plumb_bob", "rational_polynomial"}) {
    info.distortion_model = model;
    for (const std::size_t count : {4U, 5U, 8U, 12U, 14U}) {
      std::array<double, 8> k{};
      std::copy_n(d.begin(), std::min<std::size_t>(count, 8), k.begin());
      info.d.assign(k.begin(), k.begin() + std::min<std::ptrdiff_t>(count, 8));
      info.d.resize(count);
      EXPECT_EQ(*to_lens(info, {}, &report), *LensDistortion::brown(k)) << model << ' ' << count;
      EXPECT_TRUE(report.warnings.empty());
    }
  }
  for (const char* model : {"equidistant", "fisheye"}) {
    info.distortion_model = model;
    info.d = {-0.03, 0.01, -0.004, 0.0007};
    EXPECT_EQ(*to_lens(info, {}, &report), *LensDistortion::equidistant({-0.03, 0.01, -0.004, 0.0007}));
    EXPECT_TRUE(report.warnings.empty());
    info.d.assign(4, 0.0);
    EXPECT_TRUE(to_lens(info)->is_none()) << "as image_geometry reads it";
  }
}

TEST(Cameras, LensesGoThereAndBack) {
  for (const LensDistortion& lens :
       {LensDistortion(), *LensDistortion::brown({-0.3, 0.1, 0.001, -0.002, 0.05, 0.0, 0.0, 0.0}),
        *LensDistortion::brown({0.4, -0.2, 0.0007, -0.0003, 0.02, 0.7, -0.3, 0.05}),
        *LensDistortion::equidistant({-0.03, 0.01, -0.004, 0.0007})}) {
    EXPECT_EQ(*to_lens(to_ros_camera_info(kCamera, {}, lens)), lens);
    EXPECT_EQ(*to_camera(to_ros_camera_info(kCamera, {}, lens)), kCamera);
  }
}

TEST(Cameras, SayWhichDistortionIsIgnored) {
  RosCameraInfo info = to_ros_camera_info(kCamera, {});
  CameraReport report;
  info.d = {0.1, 0.0, 0.0};
  EXPECT_TRUE(to_lens(info, {}, &report)->is_none());
  EXPECT_THAT(report.warnings.at(0),
              HasSubstr("'plumb_bob' with 3 coefficients is unknown, the distortion is ignored"));
  info.distortion_model = "omnidirectional\n";
  info.d.assign(5, 0.1);
  EXPECT_TRUE(to_lens(info, {}, &report)->is_none());
  EXPECT_THAT(report.warnings.at(0), HasSubstr("'omnidirectional\\x0a' with 5 coefficients is unknown"));
  EXPECT_TRUE(to_lens(info, {.rectified = true}, &report)->is_none());
  EXPECT_TRUE(report.warnings.empty()) << "rectified images have no distortion";
  // A thin prism is left out, the rest is not.
  info.distortion_model = "rational_polynomial";
  info.d = {-0.3, 0.1, 0.001, -0.002, 0.05, 0.2, -0.1, 0.03, 0.001, 0.0, 0.0, 0.0};
  EXPECT_EQ(*to_lens(info, {}, &report), *LensDistortion::brown({-0.3, 0.1, 0.001, -0.002, 0.05, 0.2, -0.1, 0.03}));
  EXPECT_THAT(report.warnings.at(0), HasSubstr("d: coefficients 9 to 12 (thin prism and tilted sensor) are ignored"));
}

TEST(Cameras, RefuseALensThatIsNotFinite) {
  RosCameraInfo info = to_ros_camera_info(kCamera, {});
  info.d[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(to_lens(info).status().code(), StatusCode::kInvalidInput);
  EXPECT_THAT(to_lens(info).status().message(), HasSubstr("d: lens coefficient 2 is not finite"));
  EXPECT_TRUE(to_lens(info, {.rectified = true}).ok());
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
