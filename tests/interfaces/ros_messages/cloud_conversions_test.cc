// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::interfaces::cloud_conversions_test {
namespace {

using core::StatusCode;
using testing::HasSubstr;

constexpr int kWidth = 16;
constexpr int kHeight = 12;

/// A slope of depth 0.8 m and more, seen by a camera of 20 pixels focal length.
double depth_at(int u, int v) { return 0.8 + 0.01 * u + 0.02 * v; }
double x_at(int u, int v) { return (u - 7.5) / 20.0 * depth_at(u, v); }
double y_at(int u, int v) { return (v - 5.5) / 20.0 * depth_at(u, v); }

template <class Number>
void put(std::vector<std::uint8_t>& data, std::size_t at, Number number, bool big_endian) {
  std::uint8_t bytes[sizeof number];
  std::memcpy(bytes, &number, sizeof number);
  if (big_endian) std::reverse(std::begin(bytes), std::end(bytes));
  std::memcpy(data.data() + at, bytes, sizeof number);
}

/// x, y, z behind four other bytes of each point, and six bytes of padding after each row but the last.
template <class Number = float>
RosPointCloud2 cloud(bool big_endian = false) {
  RosPointCloud2 cloud;
  cloud.width = kWidth;
  cloud.height = kHeight;
  cloud.is_bigendian = big_endian;
  const std::uint8_t datatype = sizeof(Number) == 4 ? 7 : 8;
  cloud.fields = {{"rgb", 0, 7, 1}};
  for (const auto& [name, place] : {std::pair{"z", 2U}, {"x", 0U}, {"y", 1U}})
    cloud.fields.push_back({name, 4 + place * static_cast<std::uint32_t>(sizeof(Number)), datatype, 1});
  cloud.point_step = 4 + 3 * static_cast<std::uint32_t>(sizeof(Number));
  cloud.row_step = kWidth * cloud.point_step + 6;
  cloud.data.resize(std::size_t{cloud.row_step} * (kHeight - 1) + kWidth * cloud.point_step);
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const std::size_t at =
          static_cast<std::size_t>(v) * cloud.row_step + static_cast<std::size_t>(u) * cloud.point_step + 4;
      put(cloud.data, at, static_cast<Number>(x_at(u, v)), big_endian);
      put(cloud.data, at + sizeof(Number), static_cast<Number>(y_at(u, v)), big_endian);
      put(cloud.data, at + 2 * sizeof(Number), static_cast<Number>(depth_at(u, v)), big_endian);
    }
  }
  return cloud;
}

void set_z(RosPointCloud2& cloud, int u, int v, float z) {
  put(cloud.data, static_cast<std::size_t>(v) * cloud.row_step + static_cast<std::size_t>(u) * cloud.point_step + 12, z,
      false);
}

std::string refusal(const RosPointCloud2& cloud) { return to_depth_image(cloud).status().message(); }

TEST(DepthFromClouds, IsTheZOfEachPoint) {
  for (const RosPointCloud2& one : {cloud<float>(), cloud<float>(true), cloud<double>(), cloud<double>(true)}) {
    DepthImageReport report;
    const auto depth = to_depth_image(one, {}, &report);
    ASSERT_TRUE(depth.ok()) << depth.status().message();
    ASSERT_EQ(depth->width(), kWidth);
    ASSERT_EQ(depth->height(), kHeight);
    for (int v = 0; v < kHeight; ++v)
      for (int u = 0; u < kWidth; ++u) EXPECT_FLOAT_EQ((*depth)(u, v), static_cast<float>(depth_at(u, v)));
    EXPECT_EQ(report.measured, kWidth * kHeight);
    EXPECT_NEAR(report.median_depth, 0.985, 0.02);
  }
}

TEST(DepthFromClouds, TakesPointsWithoutDepthAsMissing) {
  RosPointCloud2 holes = cloud();
  set_z(holes, 0, 0, std::numeric_limits<float>::quiet_NaN());
  set_z(holes, 1, 0, std::numeric_limits<float>::infinity());
  set_z(holes, 2, 0, -1.0F);
  set_z(holes, 3, 0, 0.0F);
  holes.is_dense = true;  // which is not so
  DepthImageReport report;
  const auto depth = to_depth_image(holes, {}, &report);
  ASSERT_TRUE(depth.ok()) << depth.status().message();
  for (int u = 0; u < 4; ++u) EXPECT_EQ((*depth)(u, 0), 0.0F);
  EXPECT_EQ(report.missing, 4);
}

TEST(DepthFromClouds, RefusesPointsOfABodyFrame) {
  // x forward, y left, z up, as drivers publish in the frame of the camera's housing.
  RosPointCloud2 body = cloud();
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const std::size_t at =
          static_cast<std::size_t>(v) * body.row_step + static_cast<std::size_t>(u) * body.point_step + 4;
      put(body.data, at, static_cast<float>(depth_at(u, v)), false);
      put(body.data, at + 4, static_cast<float>(-x_at(u, v)), false);
      put(body.data, at + 8, static_cast<float>(-y_at(u, v)), false);
    }
  }
  EXPECT_THAT(refusal(body), HasSubstr("optical frame"));
  // The same where x and y are mirrored: the image would be.
  RosPointCloud2 mirrored = cloud();
  for (RosPointField& field : mirrored.fields)
    if (field.name == "x" || field.name == "y") field.name = field.name == "x" ? "y" : "x";
  EXPECT_THAT(refusal(mirrored), HasSubstr("optical frame"));
}

TEST(DepthFromClouds, RefusesCloudsThatAreNoImage) {
  RosPointCloud2 line = cloud();
  line.width *= line.height;
  line.height = 1;
  EXPECT_THAT(refusal(line), HasSubstr("not organised"));
  RosPointCloud2 none = cloud();
  none.width = 0;
  EXPECT_THAT(refusal(none), HasSubstr("is 0 x 12"));
  RosPointCloud2 far = cloud();
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const std::size_t at =
          static_cast<std::size_t>(v) * far.row_step + static_cast<std::size_t>(u) * far.point_step + 4;
      put(far.data, at, static_cast<float>(1000.0 * x_at(u, v)), false);
      put(far.data, at + 4, static_cast<float>(1000.0 * y_at(u, v)), false);
      put(far.data, at + 8, static_cast<float>(1000.0 * depth_at(u, v)), false);
    }
  }
  EXPECT_THAT(refusal(far), HasSubstr("millimetres"));
}

TEST(DepthFromClouds, NamesTheFieldThatIsWrong) {
  const auto with = [](const auto& change) {
    RosPointCloud2 changed = cloud();
    change(changed);
    return refusal(changed);
  };
  EXPECT_THAT(with([](auto& c) { c.fields.pop_back(); }), HasSubstr("there is no 'y'"));
  EXPECT_THAT(with([](auto& c) { c.fields.clear(); }), HasSubstr("there is no 'x'"));
  EXPECT_THAT(with([](auto& c) { c.fields[0].name = "z"; }), HasSubstr("two named 'z'"));
  EXPECT_THAT(with([](auto& c) { c.fields[1].datatype = 5; }), HasSubstr("datatype 5"));
  EXPECT_THAT(with([](auto& c) { c.fields[1].count = 3; }), HasSubstr("count 3"));
  EXPECT_EQ(with([](auto& c) { c.fields[1].count = 0; }), "") << "old senders write 0 for 1";
  EXPECT_THAT(with([](auto& c) { c.fields[1].offset = 13; }), HasSubstr("at byte 13 does not lie in a point of 16"));
  EXPECT_THAT(with([](auto& c) { c.fields[1].offset = 0xfffffffe; }), HasSubstr("does not lie in a point"));
  EXPECT_THAT(with([](auto& c) { c.point_step = 0; }), HasSubstr("point_step: is 0"));
  EXPECT_THAT(with([](auto& c) { c.row_step = kWidth * c.point_step - 1; }), HasSubstr("row_step: 255 is less"));
  EXPECT_THAT(with([](auto& c) { c.point_step = 0x20000000; }), HasSubstr("row_step"));
  EXPECT_THAT(with([](auto& c) { c.data.pop_back(); }), HasSubstr("data: has"));
  EXPECT_THAT(with([](auto& c) { c.row_step = 0xffffffff; }), HasSubstr("data: has"));
}

TEST(DepthFromClouds, TakesNoMemoryForCloudsBeyondTheLimits) {
  RosPointCloud2 huge = cloud();
  huge.width = huge.height = 0xffffffff;
  EXPECT_EQ(to_depth_image(huge).status().code(), StatusCode::kResourceExhausted);
  huge.width = huge.height = 16384;
  EXPECT_EQ(to_depth_image(huge).status().code(), StatusCode::kResourceExhausted);
}

TEST(DepthFromClouds, ReadsNothingBeyondTheData) {
  const RosPointCloud2 whole = cloud();
  for (std::size_t length = 0; length < whole.data.size(); length += 5) {
    RosPointCloud2 cut = whole;
    cut.data.resize(length);
    EXPECT_FALSE(to_depth_image(cut).ok()) << length;
  }
}

}  // namespace
}  // namespace prescene::interfaces::cloud_conversions_test
