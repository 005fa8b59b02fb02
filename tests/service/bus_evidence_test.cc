// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/bus_evidence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "tests/service/recorded_box.h"

namespace prescene::service::bus_evidence_test {
namespace {

using interfaces::RosHeader;
using testing::HasSubstr;

constexpr core::TimeNs kMs = 1'000'000;
constexpr core::TimeNs kNoon = 1'700'000'000'000 * kMs;

/// A robot whose camera, 80 x 60, is fixed in the world; every part of it can be made wrong.
struct Robot {
  InputTopics topics;
  std::string depth_frame = "camera";
  std::string color_frame = "camera";
  std::string info_frame = "camera";
  int info_width = 80;
  int color_width = 80;
  bool sends_color = true;
  bool sends_tf = true;
  core::TimeNs clock_ahead_ns = -20 * kMs;  // of stamps, to this machine's clock
  geometry::PinholeCamera camera{80, 60, 76.8, 76.8, 39.5, 29.5};
  float depth = 0.8F;

  /// What the doctor has seen after `frames` frames, 33 ms apart.
  void send(BusEvidence& evidence, int frames = 10) const {
    const auto give = [&](const std::string& topic, const std::string& type, const auto& message, core::TimeNs now_ns) {
      evidence.add({topic, type, interfaces::encode_cdr(message), now_ns, now_ns}, now_ns);
    };
    for (int i = 0; i < frames; ++i) {
      const core::TimeNs now_ns = kNoon + i * 33 * kMs;
      const auto header = [&](const std::string& frame) {
        return RosHeader{interfaces::to_ros_time(now_ns + clock_ahead_ns), frame};
      };
      if (sends_tf && i == 0) {
        const interfaces::FrameTransform base{"world", "base", 0, geometry::Pose::from_translation({0.1, 0.0, 0.0})};
        const interfaces::FrameTransform lens{"base", "camera", 0, geometry::Pose::from_translation({0.0, 0.0, 0.5})};
        give(topics.tf_static, "tf2_msgs/msg/TFMessage",
             interfaces::RosTfMessage{{interfaces::to_ros_transform(base), interfaces::to_ros_transform(lens)}},
             now_ns);
      }
      geometry::PinholeCamera described = camera;
      described.width = info_width;
      give(topics.camera_info, "sensor_msgs/msg/CameraInfo",
           interfaces::to_ros_camera_info(described, header(info_frame)), now_ns);
      if (sends_color)
        give(topics.color, "sensor_msgs/msg/Image",
             interfaces::to_ros_image(geometry::ColorImage(color_width, 60, {9, 9, 9}), header(color_frame)), now_ns);
      give(topics.depth, "sensor_msgs/msg/Image",
           interfaces::to_ros_image_16uc1(geometry::DepthImage(80, 60, depth), header(depth_frame)), now_ns);
      evidence.take_frames(now_ns);
    }
    evidence.take_frames(kNoon + frames * 33 * kMs + 1000 * kMs);
  }
};

/// Somebody offers everything, and the buffer is large.
BusSurroundings healthy(const InputTopics& topics = {}) {
  BusSurroundings around;
  around.domain = 3;
  around.interfaces = "eth0 (index 2 priority 0)";
  around.participants = 2;
  around.granted_buffer = around.asked_buffer = 8 << 20;
  for (const auto& [name, type] : {std::pair{topics.depth, "sensor_msgs/msg/Image"},
                                   {topics.color, "sensor_msgs/msg/Image"},
                                   {topics.camera_info, "sensor_msgs/msg/CameraInfo"}})
    around.topics.push_back({name, type, 1, 0});
  return around;
}

struct Told {
  std::vector<DoctorCheck> checks;
  CheckStatus worst() const {
    return std::max_element(checks.begin(), checks.end(),
                            [](const auto& a, const auto& b) { return a.status < b.status; })
        ->status;
  }
  const DoctorCheck& of(const std::string& name) const {
    const auto found =
        std::find_if(checks.begin(), checks.end(), [&](const DoctorCheck& check) { return check.name == name; });
    static const DoctorCheck kNothing;
    EXPECT_NE(found, checks.end()) << name;
    return found == checks.end() ? kNothing : *found;
  }
  /// The only check that is not ok.
  void expect_only(const std::string& name, CheckStatus status, const std::string& what) const {
    for (const DoctorCheck& check : checks) {
      if (check.status == CheckStatus::kOk) continue;
      EXPECT_EQ(check.name, name) << check.what;
      EXPECT_EQ(check.status, status);
      EXPECT_THAT(check.what, HasSubstr(what));
      EXPECT_FALSE(check.remedy.empty());
    }
    EXPECT_NE(worst(), CheckStatus::kOk) << name;
  }
};

Told told(const Robot& robot, const TrackerSettings& settings = {}, const BusSurroundings& around = healthy()) {
  BusEvidence evidence(settings, nullptr);
  robot.send(evidence);
  return {checks_of(evidence, around)};
}

TEST(Doctor, FindsNothingWrongWithASoundRobot) {
  const Told healthy_one = told({});
  for (const DoctorCheck& check : healthy_one.checks) {
    EXPECT_EQ(check.status, CheckStatus::kOk) << check.name << ": " << check.what;
    EXPECT_EQ(check.remedy, "") << check.name;
  }
  EXPECT_THAT(healthy_one.of("depth image").what, HasSubstr("80 x 60 '16UC1', 30.3 Hz, frame 'camera'"));
  EXPECT_THAT(healthy_one.of("tf to the camera").what,
              HasSubstr("camera > base > world; the camera is at (0.100, 0.000, 0.500) m of 'world'"));
  EXPECT_THAT(healthy_one.of("frames").what, HasSubstr("10 of 10 depth images"));
  EXPECT_THAT(healthy_one.of("stamps").what, HasSubstr("20 ms (median)"));
  EXPECT_THAT(healthy_one.of("intrinsics").what, HasSubstr("55 degrees wide"));
}

TEST(Doctor, NamesTheTopicsThatAreThereWhereNothingComes) {
  BusSurroundings around = healthy();
  around.topics = {{"/camera/camera/aligned_depth_to_color/image_raw", "sensor_msgs/msg/Image", 1, 0},
                   {"/camera/camera/color/image_raw", "sensor_msgs/msg/Image", 1, 0},
                   {"/odom", "nav_msgs/msg/Odometry", 1, 0}};
  const BusEvidence nothing({}, nullptr);
  const Told all{checks_of(nothing, around)};
  EXPECT_EQ(all.of("depth image").status, CheckStatus::kError);
  EXPECT_THAT(all.of("depth image").what, HasSubstr("image topics in DDS domain 3: /camera/camera/aligned"));
  EXPECT_THAT(all.of("depth image").what, HasSubstr("--camera realsense has these names"));
  EXPECT_THAT(all.of("depth image").what, Not(HasSubstr("/odom")));
  EXPECT_EQ(all.of("camera info").status, CheckStatus::kError);
  EXPECT_EQ(all.of("colour image").status, CheckStatus::kWarning) << "colour helps, but is not needed";
}

TEST(Doctor, TellsASilentCameraFromATopicOfAnotherType) {
  const BusEvidence nothing({}, nullptr);
  EXPECT_THAT(Told{checks_of(nothing, healthy())}.of("depth image").what, HasSubstr("though somebody offers it"));
  BusSurroundings packed = healthy();
  packed.topics[0].type = "sensor_msgs/msg/CompressedImage";
  const Told other{checks_of(nothing, packed)};
  EXPECT_THAT(other.of("depth image").what, HasSubstr("carries sensor_msgs/msg/CompressedImage"));
  EXPECT_THAT(other.of("depth image").remedy, HasSubstr("--depth-form compressed"));
}

TEST(Doctor, SeesThatNobodyIsThere) {
  BusSurroundings alone = healthy();
  alone.participants = 0;
  told({}, {}, alone).expect_only("domain", CheckStatus::kError, "nobody else is in DDS domain 3");
  BusSurroundings local = healthy();
  local.ros["ROS_LOCALHOST_ONLY"] = "1";
  told({}, {}, local).expect_only("network interface", CheckStatus::kWarning, "ROS_LOCALHOST_ONLY=1");
  BusSurroundings twice = healthy();
  twice.topics[0].writers = 2;
  told({}, {}, twice).expect_only("depth image", CheckStatus::kWarning, "2 nodes publish on it");
  BusSurroundings second = healthy();
  second.other_services = 1;
  told({}, {}, second).expect_only("other services", CheckStatus::kWarning, "another service publishes");
}

TEST(Doctor, ComparesTheBufferWithTheFrames) {
  BusSurroundings small = healthy();
  small.granted_buffer = 212992;
  told({}, {}, small).expect_only("receive buffer", CheckStatus::kWarning, "grants 208.0 KiB");
  EXPECT_THAT(told({}, {}, small).of("receive buffer").remedy, HasSubstr("sysctl -w net.core.rmem_max=8388608"));
  BusSurroundings losing = healthy();
  losing.lost_datagrams = 17;
  told({}, {}, losing).expect_only("receive buffer", CheckStatus::kWarning, "17 datagrams were lost");
}

TEST(Doctor, SeesImagesThatDoNotAgree) {
  Robot robot;
  robot.info_width = 160;
  const Told sizes = told(robot);
  EXPECT_THAT(sizes.of("images agree").what, HasSubstr("for 160 x 60 pixels, the depth image has 80 x 60"));
  EXPECT_EQ(sizes.of("images agree").status, CheckStatus::kError);
  EXPECT_EQ(sizes.of("frames").status, CheckStatus::kError);
  robot = {};
  robot.info_frame = "depth_optical";
  told(robot).expect_only("images agree", CheckStatus::kWarning, "'camera', the camera info of 'depth_optical'");
  robot = {};
  robot.color_width = 100;
  told(robot).expect_only("images agree", CheckStatus::kWarning, "depth has 80 x 60 pixels, colour 100 x 60");
  robot = {};
  robot.color_frame = "color_optical";
  told(robot).expect_only("images agree", CheckStatus::kWarning, "colour of 'color_optical'");
}

TEST(Doctor, FollowsTheChainOfFrames) {
  Robot robot;
  robot.sends_tf = false;
  const Told none = told(robot);
  EXPECT_EQ(none.of("tf to the camera").status, CheckStatus::kError);
  EXPECT_THAT(none.of("tf to the camera").what, HasSubstr("nothing has come on /tf and /tf_static"));
  EXPECT_THAT(none.of("frames").what, HasSubstr("0 of 10"));
  TrackerSettings settings;
  settings.assembler.X_WC = geometry::Pose::from_translation({0.0, 0.0, 1.0});
  EXPECT_EQ(told(robot, settings).worst(), CheckStatus::kOk) << "a pose that is given needs no tf";
  settings = {};
  settings.assembler.world_frame = "map";
  EXPECT_THAT(told({}, settings).of("tf to the camera").what, HasSubstr("no transform names the frame 'map'"));
}

TEST(Doctor, MissesBodiesOfTheScene) {
  const auto scene = load_scene_text(
      tests::box_on_table("0.3") + "robot:\n  gripper: {box: [0.1, 0.1, 0.1], pose: {position: [0.3, 0, 0.4]}}\n",
      "scene.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  BusEvidence evidence({}, scene->get());
  Robot().send(evidence);
  Told{checks_of(evidence, healthy())}.expect_only("robot", CheckStatus::kWarning, "the pose of: gripper");
}

TEST(Doctor, DoubtsCalibrationsAndClocks) {
  Robot robot;
  robot.camera.fx = robot.camera.fy = 800.0;
  told(robot).expect_only("intrinsics", CheckStatus::kWarning, "no usual depth camera");
  robot = {};
  robot.camera.cx = 5.0;
  told(robot).expect_only("intrinsics", CheckStatus::kWarning, "far from the middle");
  robot = {};
  robot.clock_ahead_ns = 5000 * kMs;
  told(robot).expect_only("stamps", CheckStatus::kWarning, "5.00 s after they came");
  robot.clock_ahead_ns = -3600'000 * kMs;
  told(robot).expect_only("stamps", CheckStatus::kWarning, "3600.00 s before they came");
  robot = {};
  robot.depth = 0.0F;
  told(robot).expect_only("depth values", CheckStatus::kWarning, "0 % of the pixels have depth");
}

/// A camera of its own topics.
InputTopics topics_of(const std::string& name) {
  InputTopics topics;
  topics.depth = "/" + name + "/depth";
  topics.color = "/" + name + "/color";
  topics.camera_info = "/" + name + "/info";
  return topics;
}

/// Of what two robots' cameras, front and side, send.
Told told_of_two(const Robot& front, const Robot& side) {
  std::vector<BusEvidence> cameras;
  BusSurroundings around = healthy();
  around.topics.clear();
  for (const auto& [name, robot] : {std::pair("front", front), {"side", side}}) {
    TrackerSettings settings;
    settings.topics = topics_of(name);
    settings.assembler.doubts_X_WC = true;
    settings.assembler.X_WC = geometry::Pose::from_translation({0.0, 0.0, 1.0});
    Robot own = robot;
    own.topics = settings.topics;
    own.send(cameras.emplace_back(settings, nullptr, name));
    const auto offered = healthy(settings.topics).topics;
    around.topics.insert(around.topics.end(), offered.begin(), offered.end());
  }
  return {checks_of(cameras, around)};
}

TEST(Doctor, LooksAtEveryCamera) {
  const Told both = told_of_two({}, {});
  for (const DoctorCheck& check : both.checks)
    EXPECT_EQ(check.status, CheckStatus::kOk) << check.camera << " " << check.name << ": " << check.what;
  EXPECT_EQ(both.of("cameras").what, "frames of all can be used: front, side");
  for (const char* name : {"depth image", "camera info", "intrinsics", "tf to the camera", "frames", "images agree"})
    for (const char* camera : {"front", "side"})
      EXPECT_EQ(std::count_if(both.checks.begin(), both.checks.end(),
                              [&](const auto& check) { return check.name == name && check.camera == camera; }),
                1)
          << name << " of " << camera;
}

TEST(Doctor, SaysWhichCameraIsWrongAndWhereToMendIt) {
  Robot wrong;
  wrong.info_width = 160;
  const Told sizes = told_of_two({}, wrong);
  EXPECT_EQ(sizes.worst(), CheckStatus::kWarning) << "the other camera would track";
  EXPECT_EQ(sizes.of("cameras").what, "frames of front can be used, those of side can't");
  for (const DoctorCheck& check : sizes.checks) {
    if (check.status != CheckStatus::kOk && check.name != "cameras") {
      EXPECT_EQ(check.camera, "side") << check.name;
    }
  }
  EXPECT_EQ(told_of_two(wrong, wrong).worst(), CheckStatus::kError);

  wrong = {};
  wrong.color_width = 100;
  EXPECT_THAT(told_of_two(wrong, {}).of("images agree").remedy, HasSubstr("'topics.color' of the camera in the scene"));
  wrong = {};
  wrong.sends_tf = false;
  const Told placed = told_of_two(wrong, {});
  EXPECT_EQ(placed.of("tf to the camera").status, CheckStatus::kWarning);
  EXPECT_THAT(placed.of("tf to the camera").what, HasSubstr("it is taken to be where the scene file says"));
}

TEST(Doctor, ComparesTheClocksOfCameras) {
  Robot behind;
  behind.clock_ahead_ns = -520 * kMs;
  const Told clocks = told_of_two({}, behind);
  EXPECT_EQ(clocks.of("clocks").status, CheckStatus::kWarning);
  EXPECT_THAT(clocks.of("clocks").what, HasSubstr("stamps of side are 500 ms behind those of front"));
  EXPECT_THAT(clocks.of("clocks").remedy, HasSubstr("NTP"));
}

TEST(Doctor, SaysWhichCameraSendsNothing) {
  std::vector<BusEvidence> cameras;
  TrackerSettings settings;
  settings.topics = topics_of("front");
  cameras.emplace_back(settings, nullptr, "front");
  const Told none{checks_of(cameras, healthy())};
  EXPECT_THAT(none.of("depth image").what, HasSubstr("camera 'front': no depth image on /front/depth"));
  EXPECT_THAT(none.of("depth image").remedy, HasSubstr("'topics.depth' of the camera in the scene file"));
}

TEST(Doctor, RepeatsWhyMessagesAreRefused) {
  BusEvidence evidence({}, nullptr);
  const InputTopics topics;
  interfaces::RosImage image = interfaces::to_ros_image(geometry::ColorImage(8, 8), {});
  for (int i = 0; i < 3; ++i)
    evidence.add({topics.depth, "sensor_msgs/msg/Image", interfaces::encode_cdr(image), kNoon, kNoon}, kNoon);
  evidence.add({topics.depth, "sensor_msgs/msg/Image", {1, 2, 3}, kNoon, kNoon}, kNoon);
  const Told all{checks_of(evidence, healthy())};
  EXPECT_EQ(all.of("depth image").status, CheckStatus::kError);
  EXPECT_THAT(all.of("depth image").what, HasSubstr("all 4 messages"));
}

}  // namespace
}  // namespace prescene::service::bus_evidence_test
