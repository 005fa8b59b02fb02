// SPDX-License-Identifier: Apache-2.0
// The bundled texts against ROS 2's own type hashes: a hash fixes every name, type and order of fields in the closure.
#include "prescene/interfaces/ros_messages/schemas.h"

#include <gtest/gtest.h>

#include "prescene/interfaces/ros_messages/messages.h"
#include "tests/interfaces/ros_messages/schema_walk.h"
#include "tests/interfaces/ros_messages/sha256.h"

namespace prescene::interfaces {
namespace {

TEST(Sha256, GivesThePublishedExamples) {
  EXPECT_EQ(tests::sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(tests::sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST(RosSchemas, GiveTheTypeHashesOfRos2) {
  for (const RosType& type : ros_types()) {
    EXPECT_EQ(tests::type_hash(tests::parse_schema(type.name, ros2msg_schema(type))), type.type_hash) << type.name;
  }
}

TEST(RosSchemas, AreOrderedAndNamedForDds) {
  for (std::size_t i = 1; i < ros_types().size(); ++i) EXPECT_LT(ros_types()[i - 1].name, ros_types()[i].name);
  EXPECT_EQ(ros_type<RosImage>().dds_name, "sensor_msgs::msg::dds_::Image_");
  EXPECT_EQ(ros_type<RosDetection3dArray>().name, "vision_msgs/msg/Detection3DArray");
}

TEST(RosSchemas, AreFoundByBothFormsOfTheirName) {
  EXPECT_EQ(find_ros_type("sensor_msgs/msg/Image"), &ros_type<RosImage>());
  EXPECT_EQ(find_ros_type("sensor_msgs/Image"), &ros_type<RosImage>());
  for (const char* name :
       {"sensor_msgs/msg/Imag", "Image", "", "/", "sensor_msgs/srv/Image", "x/y/sensor_msgs/Image"}) {
    EXPECT_EQ(find_ros_type(name), nullptr) << name;
  }
}

TEST(RosSchemas, SeparateNestedTypesAsRosbag2Does) {
  EXPECT_EQ(ros2msg_schema(ros_type<RosHeader>()), "builtin_interfaces/Time stamp\nstring frame_id\n" +
                                                       std::string(80, '=') +
                                                       "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n");
}

}  // namespace
}  // namespace prescene::interfaces
