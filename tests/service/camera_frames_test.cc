// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/camera_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <set>
#include <utility>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service::camera_frames_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr core::TimeNs kMs = 1'000'000;

/// A frame that was taken: which camera's, and its stamp in ms.
using Taken = std::pair<int, core::TimeNs>;

/// Two cameras, front and side, with depth alone.
class CameraFramesTest : public testing::Test {
 protected:
  CameraFramesTest() : frames_({input("front"), input("side")}, {}, {}) {
    interfaces::RosTfMessage tf;
    for (const char* name : {"front", "side"}) {
      const interfaces::RosHeader header{interfaces::to_ros_time(0), name};
      send(std::string("/") + name + "/info", "sensor_msgs/msg/CameraInfo",
           interfaces::encode_cdr(interfaces::to_ros_camera_info({8, 6, 10.0, 10.0, 3.5, 2.5}, header)), 0);
      tf.transforms.push_back(
          interfaces::to_ros_transform(interfaces::FrameTransform{"world", name, 0, geometry::Pose::identity()}));
    }
    send("/tf_static", "tf2_msgs/msg/TFMessage", interfaces::encode_cdr(tf), 0);
  }

  static CameraInput input(const std::string& name) {
    CameraInput camera;
    camera.name = name;
    camera.topics.depth = "/" + name + "/depth";
    camera.topics.color = "";
    camera.topics.camera_info = "/" + name + "/info";
    return camera;
  }

  void send(const std::string& topic, const std::string& type, std::vector<std::uint8_t> cdr,
            core::TimeNs received_ns) {
    const auto taken = frames_.take_in({topic, type, std::move(cdr), received_ns, received_ns}, next_++, received_ns);
    ASSERT_TRUE(taken.has_value());
    ASSERT_TRUE(taken->ok()) << taken->message();
  }

  void depth(const std::string& camera, core::TimeNs stamp_ms, core::TimeNs received_ms, const std::string& frame = "",
             float metres = 0.75F) {
    const interfaces::RosHeader header{interfaces::to_ros_time(stamp_ms * kMs), frame.empty() ? camera : frame};
    send("/" + camera + "/depth", "sensor_msgs/msg/Image",
         interfaces::encode_cdr(interfaces::to_ros_image_16uc1(geometry::DepthImage(8, 6, metres), header)),
         received_ms * kMs);
  }

  /// All that can be taken then.
  std::vector<Taken> taken(core::TimeNs now_ms) {
    std::vector<Taken> all;
    while (const auto frame = frames_.take(now_ms * kMs))
      all.emplace_back(frame->observation.camera, frame->observation.stamp_ns / kMs);
    return all;
  }

  std::vector<std::string> skipped() {
    std::vector<std::string> reasons;
    for (const SkippedFrame& frame : frames_.take_skipped()) reasons.push_back(frame.reason);
    return reasons;
  }

  CameraFrames frames_;
  MessageIndex next_ = 0;
};

TEST_F(CameraFramesTest, TakesFramesInTheOrderOfTheirStamps) {
  depth("front", 1000, 1001);
  EXPECT_THAT(taken(1001), ElementsAre(Taken{0, 1000}));
  depth("side", 1020, 1025);
  EXPECT_THAT(taken(1025), ElementsAre(Taken{1, 1020}));
  depth("front", 1033, 1034);
  EXPECT_THAT(taken(1034), ElementsAre(Taken{0, 1033})) << "of the side no period is known, so nothing is expected";
  depth("side", 1053, 1058);
  EXPECT_THAT(taken(1058), ElementsAre(Taken{1, 1053}));
  depth("front", 1066, 1067);
  EXPECT_THAT(taken(1067), ElementsAre(Taken{0, 1066})) << "the side's next is later";
  // The side's frame comes late, the front's has to wait for it.
  depth("front", 1099, 1100);
  EXPECT_THAT(taken(1100), ElementsAre());
  EXPECT_EQ(frames_.next_deadline(), 1150 * kMs);
  depth("side", 1086, 1120);
  EXPECT_THAT(taken(1120), ElementsAre(Taken{1, 1086}, Taken{0, 1099}));
  EXPECT_THAT(skipped(), ElementsAre());
}

TEST_F(CameraFramesTest, WaitNoLongerThanTold) {
  for (int i = 0; i < 3; ++i) {
    depth("front", 1000 + 33 * i, 1001 + 33 * i);
    depth("side", 1010 + 33 * i, 1012 + 33 * i);
    EXPECT_EQ(taken(1012 + 33 * i).size(), 2U);
  }
  depth("front", 1132, 1133);  // at 1076 the side had its last
  EXPECT_THAT(taken(1182), ElementsAre());
  EXPECT_THAT(taken(1183), ElementsAre(Taken{0, 1132}));
  depth("side", 1109, 1184);
  EXPECT_THAT(taken(1184), ElementsAre());
  EXPECT_THAT(skipped(), ElementsAre(HasSubstr("camera 'side': its stamps are 0.1 s behind those of camera 'front'")));
  EXPECT_EQ(frames_.skipped_count(), 1U);
}

TEST_F(CameraFramesTest, TakesBothThatWereTriggeredTogether) {
  depth("side", 1000, 1001);
  depth("front", 1000, 1002);
  EXPECT_THAT(taken(1002), ElementsAre(Taken{0, 1000}, Taken{1, 1000}));
}

TEST_F(CameraFramesTest, GoesOnWithoutACameraThatStops) {
  for (int i = 0; i < 3; ++i) {
    depth("front", 1000 + 33 * i, 1001 + 33 * i);
    depth("side", 1010 + 33 * i, 1012 + 33 * i);
    taken(1012 + 33 * i);
  }
  EXPECT_THAT(frames_.silent(1100 * kMs), ElementsAre());
  depth("front", 2200, 2201);
  EXPECT_THAT(taken(2201), ElementsAre(Taken{0, 2200})) << "it is not waited for";
  EXPECT_THAT(frames_.silent(2201 * kMs), ElementsAre(HasSubstr("camera 'side': it sends no more depth images")));
}

TEST_F(CameraFramesTest, LeavesOutACameraWithAClockOfItsOwn) {
  depth("front", 1000, 1001);
  EXPECT_EQ(taken(1001).size(), 1U);
  for (int i = 1; i < 40; ++i) {
    depth("side", 3'600'000 + 33 * i, 1000 + 33 * i);
    depth("front", 1000 + 33 * i, 1001 + 33 * i);
    EXPECT_THAT(taken(1001 + 33 * i), ElementsAre(Taken{0, 1000 + 33 * i})) << i;
  }
  EXPECT_THAT(skipped().back(), HasSubstr("camera 'side': its clock is not that of camera 'front'"));
  EXPECT_THAT(frames_.silent(2300 * kMs), ElementsAre(HasSubstr("camera 'side': none of its frames is used")));
}

TEST_F(CameraFramesTest, DoesNotWaitForOneWhoseTfIsMissing) {
  for (int i = 0; i < 40; ++i) {
    depth("side", 990 + 33 * i, 1000 + 33 * i, "nowhere");
    depth("front", 1000 + 33 * i, 1001 + 33 * i);
    const std::vector<Taken> at_once = taken(1001 + 33 * i);
    if (i > 33) {
      EXPECT_THAT(at_once, ElementsAre(Taken{0, 1000 + 33 * i})) << i;
    }
  }
  skipped();
  EXPECT_THAT(frames_.silent(2300 * kMs),
              ElementsAre(AllOf(HasSubstr("camera 'side': none of its frames is used: "), HasSubstr("'nowhere'"))));
  // Its tf comes: from then on it is used, and waited for.
  interfaces::RosTfMessage tf{
      {interfaces::to_ros_transform(interfaces::FrameTransform{"world", "nowhere", 0, geometry::Pose::identity()})}};
  send("/tf_static", "tf2_msgs/msg/TFMessage", interfaces::encode_cdr(tf), 2320 * kMs);
  depth("side", 2315, 2321, "nowhere");
  EXPECT_THAT(taken(2321), ElementsAre(Taken{1, 2315}));
  depth("front", 2350, 2351);
  EXPECT_THAT(taken(2351), ElementsAre());
  depth("side", 2348, 2360, "nowhere");
  EXPECT_THAT(taken(2360), ElementsAre(Taken{1, 2348}, Taken{0, 2350}));
  EXPECT_THAT(frames_.silent(2400 * kMs), ElementsAre());
}

TEST_F(CameraFramesTest, SaysWhichStampsAreBehindAndDoesNotWaitForThem) {
  for (int i = 0; i < 60; ++i) {
    depth("front", 1000 + 33 * i, 1001 + 33 * i);
    if (i > 1) {
      EXPECT_THAT(taken(1001 + 33 * i), ElementsAre(Taken{0, 1000 + 33 * i})) << i;
    }
    depth("side", 510 + 33 * i, 1011 + 33 * i);
    taken(1012 + 33 * i);
  }
  EXPECT_THAT(skipped().back(),
              AllOf(HasSubstr("camera 'side': its stamps are 0.5 s behind those of camera 'front'"), HasSubstr("NTP")));
  EXPECT_THAT(frames_.silent(3000 * kMs), ElementsAre(HasSubstr("none of its frames is used: its stamps are 0.5 s")));
}

TEST_F(CameraFramesTest, SaysWhereImagesOfACameraWereToCome) {
  for (int i = 0; i < 40; ++i) {
    depth("front", 1000 + 33 * i, 1001 + 33 * i);
    taken(1001 + 33 * i);
  }
  EXPECT_THAT(frames_.silent(2300 * kMs),
              ElementsAre(AllOf(HasSubstr("camera 'side': no depth image of it has come on /side/depth"),
                                HasSubstr("scene file"))));
  EXPECT_EQ(frames_.counts_text(), "front: 40 frames used, 0 not; side: 0 frames used, 0 not");
}

TEST_F(CameraFramesTest, SaysWhichCameraSeesNothingAtAll) {
  depth("front", 1000, 1001);
  depth("side", 1010, 1011, "side", 0.0F);
  const auto front = frames_.take(1011 * kMs), side = frames_.take(1011 * kMs);
  ASSERT_TRUE(front && side);
  EXPECT_THAT(front->doubts, ElementsAre());
  EXPECT_THAT(side->doubts, ElementsAre(HasSubstr("camera 'side': no pixel of its depth image is measured")));
}

TEST(CameraFrames, SaysThatItsOnlyCameraSeesNothingAtAll) {
  CameraInput only;
  only.topics.color = "";
  only.assembler.X_WC = geometry::Pose::identity();
  CameraFrames frames({only}, {}, {});
  const interfaces::RosHeader header{interfaces::to_ros_time(kMs), "camera"};
  const auto send = [&](const std::string& topic, const std::string& type, std::vector<std::uint8_t> cdr,
                        MessageIndex index) {
    const auto taken = frames.take_in({topic, type, std::move(cdr), kMs, kMs}, index, kMs);
    ASSERT_TRUE(taken.has_value() && taken->ok());
  };
  send(only.topics.camera_info, "sensor_msgs/msg/CameraInfo",
       interfaces::encode_cdr(interfaces::to_ros_camera_info({8, 6, 10.0, 10.0, 3.5, 2.5}, header)), 0);
  send(only.topics.depth, "sensor_msgs/msg/Image",
       interfaces::encode_cdr(interfaces::to_ros_image_16uc1(geometry::DepthImage(8, 6, 0.0F), header)), 1);
  const auto frame = frames.take(kMs);
  ASSERT_TRUE(frame.has_value());
  EXPECT_THAT(frame->doubts, ElementsAre(HasSubstr("no pixel of its depth image is measured")));
}

TEST_F(CameraFramesTest, TakesTheFramesThatARecordingNames) {
  depth("front", 1000, 1001);  // the numbers of these: 3, 4, 5
  depth("side", 1010, 1011);
  depth("front", 1033, 1034);
  const auto taken_of = [&](int camera, MessageIndex number) {
    const auto frame = frames_.take_recorded(camera, number, 1035 * kMs);
    return frame ? std::optional(Taken{frame->observation.camera, frame->observation.stamp_ns / kMs}) : std::nullopt;
  };
  EXPECT_EQ(taken_of(1, 4), (Taken{1, 1010}));
  EXPECT_EQ(taken_of(0, 5), (Taken{0, 1033}));
  EXPECT_EQ(taken_of(0, 3), std::nullopt) << "it was passed over";
  EXPECT_EQ(taken_of(1, 5), std::nullopt) << "it is another camera's";
  EXPECT_EQ(taken_of(2, 5), std::nullopt);
  EXPECT_THAT(skipped(), ElementsAre("camera 'front': a newer frame was ready"));
}

TEST_F(CameraFramesTest, FollowsWhenAllClocksAreSetBack) {
  const auto both = [&](core::TimeNs stamp_ms, core::TimeNs received_ms) {
    depth("front", stamp_ms, received_ms);
    depth("side", stamp_ms + 10, received_ms + 10);
    return taken(received_ms + 11);
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(both(100'000 + 33 * i, 1000 + 33 * i).size(), 2U);
  std::size_t used = 0;
  for (int i = 0; i < 6; ++i) used += both(1000 + 33 * i, 1100 + 33 * i).size();
  EXPECT_GE(used, 6U) << "three of each may have had a wrong stamp";
  EXPECT_THAT(frames_.silent(1300 * kMs), ElementsAre());
}

TEST_F(CameraFramesTest, LetsCamerasTakeTurnsWhenTheCallerIsSlow) {
  // One frame is taken in 50 ms, while each camera sends one every 25 ms, the side always a little later.
  std::array<int, 2> used = {0, 0};
  for (int i = 0; i < 80; ++i) {
    depth("front", 1000 + 25 * i, 1001 + 25 * i);
    depth("side", 1002 + 25 * i, 1003 + 25 * i);
    if (i % 2 == 1)
      if (const auto frame = frames_.take((1004 + 25 * i) * kMs))
        ++used[static_cast<std::size_t>(frame->observation.camera)];
  }
  EXPECT_GE(used[0], 12);
  EXPECT_GE(used[1], 12);
}

TEST(CameraInputs, AreThoseThatTheSceneLists) {
  belief::Scene scene;
  TrackerSettings settings;
  settings.topics.depth = "/told/depth";
  scene.camera.emplace().name = "old";
  ASSERT_EQ(camera_inputs(settings, scene).size(), 1U);
  EXPECT_EQ(camera_inputs(settings, scene).front().topics.depth, "/told/depth");
  scene.camera->topics = belief::CameraTopics{"/a/depth", "/a/color", "/a/info", "", "", true};
  scene.camera->frame = "a_optical";
  belief::SceneCamera& second = scene.more_cameras.emplace_back();
  second.name = "b";
  second.topics = belief::CameraTopics{"/b/depth", "", "/b/info", "", "", {}};
  second.is_placed = true;
  second.X_WC = geometry::Pose::from_translation({1.0, 2.0, 3.0});
  const std::vector<CameraInput> inputs = camera_inputs(settings, scene);
  ASSERT_EQ(inputs.size(), 2U);
  EXPECT_EQ(inputs[0].topics.depth, "/a/depth");
  EXPECT_EQ(inputs[0].assembler.camera_frame, "a_optical");
  EXPECT_EQ(inputs[0].assembler.rectified, true);
  EXPECT_FALSE(inputs[0].assembler.X_WC.has_value());
  EXPECT_EQ(inputs[1].assembler.X_WC->translation.z(), 3.0);
  EXPECT_TRUE(validate(inputs).ok());
  std::set<std::string> names;
  for (const BusTopic& topic : topics_of_cameras(inputs)) EXPECT_TRUE(names.insert(topic.name).second) << topic.name;
  EXPECT_TRUE(names.contains("/a/color") && names.contains("/b/depth") && names.contains("/tf"));
}

TEST(PicturedFrames, AreOfTheFirstCameraWhileItSees) {
  PicturedFrames pictured;
  const auto has = [&](int camera, core::TimeNs ms) {
    belief::Observation observation;
    observation.camera = camera;
    observation.stamp_ns = ms * kMs;
    return pictured.has(observation);
  };
  EXPECT_TRUE(has(1, 0)) << "there is no other";
  EXPECT_TRUE(has(0, 10));
  EXPECT_FALSE(has(1, 20));
  EXPECT_TRUE(has(1, 1100));
}

}  // namespace
}  // namespace prescene::service::camera_frames_test
