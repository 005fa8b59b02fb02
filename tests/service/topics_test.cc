// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/topics.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service::topics_test {
namespace {

using interfaces::TopicQos;

BusTopic named(const std::string& name) {
  const std::vector<BusTopic> rows = bus_topics({});
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const BusTopic& topic) { return topic.name == name; });
  EXPECT_NE(row, rows.end()) << name;
  return row == rows.end() ? BusTopic{} : *row;
}

// Of a burst none may push out another before it is read, live and in `record` and `replay`, which all listen so.
TEST(Topics, SayByTheirNamesThatTheyAreRectified) {
  for (const char* name : {"/camera/depth/image_rect_raw", "image_rect", "/rgb/image_rect_color",
                           "/rgb/image_rect_color/compressed", "/depth/image_rect/compressedDepth"})
    EXPECT_TRUE(names_rectified_images(name)) << name;
  for (const char* name : {"", "/image_rect/image_raw", "/camera/color/image_raw", "/image_rect/"})
    EXPECT_FALSE(names_rectified_images(name)) << name;
}

TEST(BusTopics, ControlsQuestionsAndAnswersAreReadWithoutOneReplacingAnother) {
  for (const char* name : {kControlTopic, kQueryTopic, kAnswerTopic, kTypedQueryTopic, kTypedCancelTopic}) {
    EXPECT_EQ(named(name).read, TopicQos::kCommands) << name;
  }
  EXPECT_EQ(offered_as(kControlTopic, "std_msgs/msg/String"), TopicQos::kCommands);
}

TEST(BusTopics, ColourIsLeftOutWhereItIsNotNamed) {
  InputTopics topics;
  const std::size_t all = bus_topics(topics).size();
  topics.color.clear();
  EXPECT_EQ(bus_topics(topics).size(), all - 1);
  topics.clock = kClockTopic;
  EXPECT_EQ(bus_topics(topics).size(), all) << "which is read where it is named";
  topics.clock = topics.tf;
  EXPECT_EQ(validate(topics).code(), core::StatusCode::kInvalidInput);
}

TEST(BusTopics, ImagesHaveTheTypeThatTheirNamesOrFormsSay) {
  const auto depth = [](const std::string& name, const std::string& form = "") {
    InputTopics topics;
    topics.depth = name;
    topics.depth_form = form;
    EXPECT_TRUE(validate(topics).ok()) << form;
    return depth_type(topics);
  };
  EXPECT_EQ(depth("/camera/depth/image_raw"), "sensor_msgs/msg/Image");
  EXPECT_EQ(depth("/camera/depth/image_raw/compressedDepth"), "sensor_msgs/msg/CompressedImage");
  EXPECT_EQ(depth("/camera/depth/points"), "sensor_msgs/msg/PointCloud2");
  EXPECT_EQ(depth("/zed/point_cloud/cloud_registered"), "sensor_msgs/msg/PointCloud2");
  EXPECT_EQ(depth("/points/image_raw"), "sensor_msgs/msg/Image");
  EXPECT_EQ(depth("/depth", "compressed"), "sensor_msgs/msg/CompressedImage");
  EXPECT_EQ(depth("/depth", "points"), "sensor_msgs/msg/PointCloud2");
  EXPECT_EQ(depth("/points", "image"), "sensor_msgs/msg/Image");
  InputTopics topics;
  topics.color = "/camera/color/image_raw/compressed";
  EXPECT_EQ(color_type(topics), "sensor_msgs/msg/CompressedImage");
  EXPECT_EQ(bus_topics(topics)[1].type, "sensor_msgs/msg/CompressedImage");
  topics.color_form = "points";
  EXPECT_FALSE(validate(topics).ok());
  topics.color_form = "";
  topics.depth_form = "jpeg";
  EXPECT_FALSE(validate(topics).ok());
}

TEST(BusTopics, ARenamedTopicIsOfferedByItsType) {
  EXPECT_EQ(offered_as("/robot/depth", "sensor_msgs/msg/Image"), TopicQos::kImages);
  EXPECT_EQ(offered_as("/robot/points", "sensor_msgs/msg/PointCloud2"), TopicQos::kImages);
  EXPECT_EQ(offered_as("/robot/tf_static", "tf2_msgs/msg/TFMessage"), TopicQos::kLatched);
  EXPECT_EQ(offered_as("/robot/tf", "tf2_msgs/msg/TFMessage"), TopicQos::kTf);
  EXPECT_EQ(offered_as("/tf_static", "tf2_msgs/msg/TFMessage"), TopicQos::kLatched);
}

TEST(Topics, TransformsOfObjectsAreNotTheRobots) {
  const auto message = [](const std::vector<std::string>& frames, const std::string& type = "tf2_msgs/msg/TFMessage") {
    interfaces::RosTfMessage tf;
    for (const std::string& frame : frames) {
      interfaces::FrameTransform transform{"map", frame, 5, geometry::Pose::identity()};
      tf.transforms.push_back(interfaces::to_ros_transform(transform));
    }
    return interfaces::ReceivedMessage{"/tf", type, interfaces::encode_cdr(tf), 5, 5};
  };
  EXPECT_TRUE(are_of_objects(message({"prescene/mug", "prescene/box"})));
  EXPECT_FALSE(are_of_objects(message({"prescene/mug", "hand"})));
  EXPECT_FALSE(are_of_objects(message({"prescene_camera"})));
  EXPECT_FALSE(are_of_objects(message({})));
  EXPECT_FALSE(are_of_objects(message({"prescene/mug"}, "std_msgs/msg/String")));
  interfaces::ReceivedMessage cut = message({"prescene/mug"});
  cut.cdr.resize(cut.cdr.size() / 2);
  EXPECT_FALSE(are_of_objects(cut));
}

}  // namespace
}  // namespace prescene::service::topics_test
