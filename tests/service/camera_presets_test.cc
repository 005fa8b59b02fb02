// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/camera_presets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace prescene::service::camera_presets_test {
namespace {

using interfaces::DomainTopic;
using testing::HasSubstr;

TEST(CameraPresets, AreValidNamesAndDiffer) {
  std::set<std::string_view> depths;
  for (const CameraPreset& preset : camera_presets()) {
    TrackerSettings settings;
    apply(preset, settings);
    EXPECT_TRUE(validate(settings.topics).ok()) << preset.name;
    EXPECT_TRUE(depths.insert(preset.depth).second) << preset.name;
    EXPECT_EQ(find_camera_preset(preset.name), &preset);
    EXPECT_EQ(is_rectified(settings), preset.rectified);
    EXPECT_EQ(rectified_doubt(settings), "") << preset.name;
    EXPECT_EQ(settings.topics.tf, InputTopics().tf);
    EXPECT_NE(settings.topics.depth, InputTopics().depth) << "the default is an old driver's";
  }
  EXPECT_EQ(find_camera_preset("kinect"), nullptr);
}

TEST(NothingCame, SaysWhatIsThere) {
  const InputTopics topics;
  EXPECT_THAT(nothing_came_text(topics, {}, "in DDS domain 0"),
              HasSubstr("no depth image on " + topics.depth + "; there is no image topic in DDS domain 0"));
  std::vector<DomainTopic> there = {{"/a/depth", "sensor_msgs/msg/Image", 1, 0},
                                    {"/a/points", "sensor_msgs/msg/PointCloud2", 1, 0},
                                    {"/asked/by/others", "sensor_msgs/msg/Image", 0, 2},
                                    {"/tf", "tf2_msgs/msg/TFMessage", 1, 1}};
  EXPECT_THAT(nothing_came_text(topics, there, "in the recording"),
              HasSubstr("image topics in the recording: /a/depth (Image), /a/points (PointCloud2): name the camera's"));
  there.push_back({"/zed/zed_node/depth/depth_registered", "sensor_msgs/msg/Image", 1, 0});
  EXPECT_THAT(nothing_came_text(topics, there, "here"), HasSubstr("--camera zed has these names"));
  there.push_back({topics.depth, "sensor_msgs/msg/Image", 1, 0});
  EXPECT_THAT(nothing_came_text(topics, there, "here"),
              testing::AllOf(HasSubstr(topics.depth + ": the topic is there (Image), but no message that can be used"),
                             testing::Not(HasSubstr("name the camera's"))));
  there.back().type = "std_msgs/msg/String";
  EXPECT_THAT(nothing_came_text(topics, there, "here"), HasSubstr("which is offered as std_msgs/msg/String"));
  std::vector<DomainTopic> many;
  for (int i = 0; i < 30; ++i) many.push_back({"/c" + std::to_string(i), "sensor_msgs/msg/Image", 1, 0});
  EXPECT_THAT(nothing_came_text(topics, many, "here"), HasSubstr("/c11 (Image) and 18 more"));
}

}  // namespace
}  // namespace prescene::service::camera_presets_test
