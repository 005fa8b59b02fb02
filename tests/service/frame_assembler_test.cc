// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/frame_assembler.h"

#include <gmock/gmock.h>

#include <cstring>
#include <utility>

#include "prescene/interfaces/images/lens_warp.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"

namespace prescene::service {
namespace {

constexpr core::TimeNs kMs = 1'000'000;

interfaces::RosHeader header(core::TimeNs stamp_ns, const std::string& frame = "camera") {
  return {interfaces::to_ros_time(stamp_ns), frame};
}

interfaces::RosImage depth_at(core::TimeNs stamp_ns, int width = 8) {
  return interfaces::to_ros_image_16uc1(geometry::DepthImage(width, 6, 0.75f), header(stamp_ns));
}

interfaces::RosImage color_at(core::TimeNs stamp_ns) {
  return interfaces::to_ros_image(geometry::ColorImage(8, 6, {1, 2, 3}), header(stamp_ns));
}

interfaces::RosCameraInfo camera_info() {
  return interfaces::to_ros_camera_info({8, 6, 10.0, 10.0, 3.5, 2.5}, header(0));
}

interfaces::RosTfMessage transform(const std::string& child, core::TimeNs stamp_ns, double x) {
  return {{interfaces::to_ros_transform(
      interfaces::FrameTransform{"world", child, stamp_ns, geometry::Pose::from_translation({x, 0.0, 0.0})})}};
}

AssemblerSettings without_color() {
  AssemblerSettings settings;
  settings.use_color = false;
  return settings;
}

TEST(FrameAssembler, PairsWhatBelongsTogether) {
  FrameAssembler assembler({}, {"gripper"});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  ASSERT_TRUE(assembler.add_tf(transform("gripper", 90 * kMs, 2.0), 3, false).ok());
  ASSERT_TRUE(assembler.add_tf(transform("gripper", 110 * kMs, 3.0), 4, false).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(100 * kMs), 5, 101 * kMs).ok());
  EXPECT_FALSE(assembler.take(102 * kMs).has_value()) << "its colour image is still on the way";
  ASSERT_TRUE(assembler.add_color(color_at(103 * kMs), 6, 104 * kMs).ok());
  const auto frame = assembler.take(105 * kMs);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->depth, 5u);
  EXPECT_EQ(frame->color, 6u);
  EXPECT_EQ(frame->camera_info, 1u);
  EXPECT_EQ(frame->tf_until, 4u);
  EXPECT_EQ(frame->observation.stamp_ns, 100 * kMs);
  EXPECT_DOUBLE_EQ(frame->observation.X_WC.translation.x(), 1.0);
  EXPECT_NEAR(frame->observation.robot.at("gripper").translation.x(), 2.5, 1e-12);
  EXPECT_FLOAT_EQ((*frame->observation.frame.depth)(3, 3), 0.75f);
  EXPECT_FALSE(assembler.take(106 * kMs).has_value());
  EXPECT_TRUE(assembler.take_skipped().empty());
}

TEST(FrameAssembler, TheFirstFrameWaitsForRobotBodiesThatNothingIsKnownOf) {
  FrameAssembler assembler(without_color(), {"gripper", "never"});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(100 * kMs), 3, 101 * kMs).ok());
  EXPECT_FALSE(assembler.take(102 * kMs).has_value());
  ASSERT_TRUE(assembler.add_tf(transform("gripper", 100 * kMs, 2.0), 4, false).ok());
  const auto first = assembler.take(*assembler.next_deadline());
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->observation.robot.count("gripper"), 1u);
  EXPECT_EQ(first->observation.robot.count("never"), 0u);
  ASSERT_TRUE(assembler.add_tf(transform("gripper", 140 * kMs, 2.0), 5, false).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(133 * kMs), 6, 160 * kMs).ok());
  EXPECT_TRUE(assembler.take(161 * kMs).has_value()) << "what never comes is waited for once";
}

TEST(FrameAssembler, TakesPackedImagesAndClouds) {
  const auto received = [](const std::string& type, const auto& message) {
    return interfaces::ReceivedMessage{"/t", type, interfaces::encode_cdr(message), 0, 0};
  };
  // 0.75 m as 16UC1 in PNG behind the header of compressedDepth, and colour as PNG.
  geometry::Image<std::uint16_t> millimetres(8, 6, 750);
  interfaces::RosCompressedImage packed{header(100 * kMs), "16UC1; compressedDepth png", std::vector<std::uint8_t>(12)};
  const auto png = interfaces::encode_png(std::as_const(millimetres).view());
  packed.data.insert(packed.data.end(), png.begin(), png.end());
  const geometry::ColorImage color(8, 6, {1, 2, 3});
  const interfaces::RosCompressedImage packed_color{header(100 * kMs), "rgb8; png compressed bgr8",
                                                    interfaces::encode_png(color.view())};
  FrameAssembler assembler({}, {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  auto depth = decode_depth(received("sensor_msgs/msg/CompressedImage", packed));
  ASSERT_TRUE(depth.ok()) << depth.status().message();
  EXPECT_EQ(depth->form, "16UC1; compressedDepth png");
  ASSERT_TRUE(assembler.add_depth(*std::move(depth), 3, 101 * kMs).ok());
  auto colored = decode_color_message(received("sensor_msgs/msg/CompressedImage", packed_color));
  ASSERT_TRUE(colored.ok()) << colored.status().message();
  ASSERT_TRUE(assembler.add_color(*std::move(colored), 4, 101 * kMs).ok());
  const auto frame = assembler.take(102 * kMs);
  ASSERT_TRUE(frame.has_value());
  EXPECT_FLOAT_EQ((*frame->observation.frame.depth)(3, 3), 0.75F);
  ASSERT_NE(frame->observation.frame.color, nullptr);
  EXPECT_EQ(*frame->observation.frame.color, color);

  interfaces::RosPointCloud2 cloud{header(200 * kMs),
                                   6,
                                   8,
                                   {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}},
                                   false,
                                   12,
                                   96,
                                   std::vector<std::uint8_t>(96 * 6),
                                   false};
  for (int i = 0; i < 48; ++i) {
    const float point[3] = {0.05F * (static_cast<float>(i % 8) - 3.5F), 0.05F * (static_cast<float>(i / 8) - 2.5F),
                            0.5F};
    std::memcpy(cloud.data.data() + 12 * static_cast<std::size_t>(i), point, sizeof point);
  }
  auto points = decode_depth(received("sensor_msgs/msg/PointCloud2", cloud));
  ASSERT_TRUE(points.ok()) << points.status().message();
  ASSERT_TRUE(assembler.add_depth(*std::move(points), 5, 201 * kMs).ok());
  const auto second = assembler.take(300 * kMs);
  ASSERT_TRUE(second.has_value());
  EXPECT_FLOAT_EQ((*second->observation.frame.depth)(7, 5), 0.5F);

  EXPECT_FALSE(decode_depth(received("std_msgs/msg/String", interfaces::RosString{"x"})).ok());
  EXPECT_FALSE(decode_color_message(received("sensor_msgs/msg/PointCloud2", cloud)).ok());
}

TEST(FrameAssembler, GoesWithoutColourWhenItDoesNotComeInTime) {
  FrameAssembler assembler({}, {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(100 * kMs), 3, 101 * kMs).ok());
  ASSERT_TRUE(assembler.next_deadline().has_value());
  EXPECT_FALSE(assembler.take(*assembler.next_deadline() - 1).has_value());
  const auto frame = assembler.take(*assembler.next_deadline());
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->observation.frame.color, nullptr);
  EXPECT_THAT(frame->doubts, testing::ElementsAre(testing::HasSubstr("no colour image came with the depth image")));
}

TEST(FrameAssembler, SaysWhyAColourImageOfAnotherSizeIsNotUsed) {
  FrameAssembler assembler({}, {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  const geometry::ColorImage small(4, 3, {1, 2, 3});
  ASSERT_TRUE(assembler.add_color(interfaces::to_ros_image(small, header(100 * kMs)), 3, 101 * kMs).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(100 * kMs), 4, 101 * kMs).ok());
  const auto frame = assembler.take(101 * kMs);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->observation.frame.color, nullptr);
  EXPECT_THAT(frame->doubts, testing::ElementsAre(testing::HasSubstr(
                                 "the colour image has 4 x 3 pixels, the depth image 8 x 6: depth alone is used")));
}

TEST(FrameAssembler, SkipsWithAReasonWhatStaysIncomplete) {
  FrameAssembler assembler({}, {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(100 * kMs), 2, 101 * kMs).ok());
  EXPECT_FALSE(assembler.take(200 * kMs).has_value());
  const auto skipped = assembler.take_skipped();
  ASSERT_EQ(skipped.size(), 1u);
  EXPECT_EQ(skipped[0].depth, 2u);
  EXPECT_NE(skipped[0].reason.find("'camera'"), std::string::npos) << skipped[0].reason;
}

TEST(FrameAssembler, CountsWhatItSkipsForDaysAndKeepsTheNewestReasonsOnly) {
  FrameAssembler assembler(without_color(), {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  constexpr int kFrames = 3000;
  for (int i = 0; i < kFrames; ++i) {
    ASSERT_TRUE(assembler.add_depth(depth_at((100 + i) * kMs), 2u + i, (100 + i) * kMs).ok());
    EXPECT_FALSE(assembler.take((200 + i) * kMs).has_value());
  }
  EXPECT_EQ(assembler.skipped_count(), kFrames);
  EXPECT_FALSE(assembler.last_skip().empty());
  const auto kept = assembler.take_skipped();
  EXPECT_EQ(kept.size(), 1000u);
  EXPECT_EQ(kept.back().depth, 1u + kFrames);
  EXPECT_EQ(assembler.last_skip(), "");
}

TEST(FrameAssembler, TheNewestFrameWinsAndOlderOnesAreCounted) {
  FrameAssembler assembler(without_color(), {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(assembler.add_depth(depth_at((100 + 33 * i) * kMs), 3u + i, 200 * kMs).ok());
  const auto frame = assembler.take(201 * kMs);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->depth, 5u);
  EXPECT_EQ(assembler.take_skipped().size(), 2u);
  ASSERT_TRUE(assembler.add_depth(depth_at(150 * kMs), 6, 210 * kMs).ok());
  EXPECT_FALSE(assembler.take(211 * kMs).has_value()) << "older than what was taken";
  EXPECT_EQ(assembler.take_skipped().size(), 1u);
}

TEST(FrameAssembler, ACameraInfoOfAnotherSizeIsNamed) {
  FrameAssembler assembler(without_color(), {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(100 * kMs, 16), 3, 100 * kMs).ok());
  EXPECT_FALSE(assembler.take(101 * kMs).has_value());
  const auto skipped = assembler.take_skipped();
  ASSERT_EQ(skipped.size(), 1u);
  EXPECT_NE(skipped[0].reason.find("16 x 6"), std::string::npos);
}

TEST(FrameAssembler, SaysOnceWhenTheCameraInfoChanges) {
  AssemblerSettings settings = without_color();
  settings.X_WC = geometry::Pose::identity();
  FrameAssembler assembler(settings, {});
  MessageIndex index = 0;
  const auto doubts_with = [&](const geometry::PinholeCamera& camera, const geometry::LensDistortion& lens) {
    const core::TimeNs now_ns = 100 * kMs * (index + 1);
    EXPECT_TRUE(assembler.add_camera_info(interfaces::to_ros_camera_info(camera, header(0), lens), ++index).ok());
    EXPECT_TRUE(assembler.add_depth(depth_at(now_ns, camera.width), ++index, now_ns).ok());
    const auto frame = assembler.take(now_ns);
    if (!frame) return std::vector<std::string>{"no frame"};
    EXPECT_EQ(frame->observation.frame.camera, camera);
    return frame->doubts;
  };
  const geometry::PinholeCamera first{8, 6, 10.0, 10.0, 3.5, 2.5}, zoomed{8, 6, 20.0, 20.0, 3.5, 2.5};
  const geometry::PinholeCamera larger{16, 6, 20.0, 20.0, 7.5, 2.5};
  geometry::LensDistortion lens;
  EXPECT_THAT(doubts_with(first, lens), testing::IsEmpty());
  EXPECT_THAT(doubts_with(first, lens), testing::IsEmpty());
  EXPECT_THAT(doubts_with(zoomed, lens),
              testing::ElementsAre(testing::AllOf(testing::HasSubstr("from 8 x 6 pixels, focal lengths 10.0 and 10.0"),
                                                  testing::HasSubstr("to 8 x 6 pixels, focal lengths 20.0 and 20.0"))));
  EXPECT_THAT(doubts_with(zoomed, lens), testing::IsEmpty());
  EXPECT_THAT(doubts_with(larger, lens), testing::ElementsAre(testing::HasSubstr("to 16 x 6 pixels")));
  EXPECT_THAT(doubts_with(larger, lens), testing::IsEmpty());
  geometry::PinholeCamera finer = larger;
  finer.fx += 0.002;
  EXPECT_THAT(doubts_with(finer, lens), testing::ElementsAre(testing::HasSubstr("focal lengths 20.002 and 20.000")));
}

TEST(FrameAssembler, UsesTheSetCameraPoseWhenTfKnowsNone) {
  AssemblerSettings settings = without_color();
  settings.X_WC = geometry::Pose::from_translation({0.0, 0.0, 3.0});
  FrameAssembler assembler(settings, {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(100 * kMs), 2, 100 * kMs).ok());
  const auto frame = assembler.take(101 * kMs);
  ASSERT_TRUE(frame.has_value());
  EXPECT_DOUBLE_EQ(frame->observation.X_WC.translation.z(), 3.0);
}

/// An assembler that only needs depth images; whether the frame of this stamp is used when it comes at this time.
class OfDepthOnly {
 public:
  OfDepthOnly() {
    EXPECT_TRUE(assembler_.add_camera_info(camera_info(), 1).ok());
    EXPECT_TRUE(assembler_.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  }
  bool uses(core::TimeNs stamp_ns, core::TimeNs received_ns) {
    EXPECT_TRUE(assembler_.add_depth(depth_at(stamp_ns), index_++, received_ns).ok());
    const auto frame = assembler_.take(received_ns);
    return frame && frame->observation.stamp_ns == stamp_ns;
  }
  FrameAssembler& operator*() { return assembler_; }

 private:
  FrameAssembler assembler_{without_color(), {}};
  MessageIndex index_ = 3;
};

TEST(FrameAssembler, StartsAgainWhenTheClockJumpsBack) {
  OfDepthOnly assembler;
  ASSERT_TRUE(assembler.uses(60'000 * kMs, 0));
  EXPECT_FALSE(assembler.uses(100 * kMs, 33 * kMs)) << "one or two stamps may be wrong";
  EXPECT_FALSE(assembler.uses(133 * kMs, 66 * kMs));
  EXPECT_TRUE(assembler.uses(166 * kMs, 99 * kMs));
  EXPECT_TRUE(assembler.uses(199 * kMs, 132 * kMs));
  EXPECT_EQ((*assembler).skipped_count(), 2u);
}

TEST(FrameAssembler, FollowsAClockThatIsSetForward) {
  OfDepthOnly assembler;
  ASSERT_TRUE(assembler.uses(100 * kMs, 100 * kMs));
  EXPECT_FALSE(assembler.uses(3'600'000 * kMs, 133 * kMs));
  EXPECT_FALSE(assembler.uses(3'600'033 * kMs, 166 * kMs));
  EXPECT_TRUE(assembler.uses(3'600'066 * kMs, 199 * kMs));
  EXPECT_TRUE(assembler.uses(3'600'099 * kMs, 232 * kMs));
}

TEST(FrameAssembler, OneWrongStampCostsOneFrame) {
  OfDepthOnly assembler;
  int used = 0;
  for (int i = 0; i < 30; ++i) {
    const core::TimeNs now_ns = (100'000 + 33 * i) * kMs;
    if (i % 10 == 3) {
      EXPECT_FALSE(assembler.uses(now_ns + 3'600'000 * kMs, now_ns)) << "an hour ahead";
    } else if (i % 10 == 6) {
      EXPECT_FALSE(assembler.uses(now_ns - 90'000 * kMs, now_ns)) << "long ago";
    } else {
      EXPECT_TRUE(assembler.uses(now_ns, now_ns)) << i;
      ++used;
    }
  }
  EXPECT_EQ(used, 24);
}

TEST(FrameAssembler, APauseAndAFastReplayAreNoJumps) {
  OfDepthOnly assembler;
  ASSERT_TRUE(assembler.uses(100 * kMs, 100 * kMs));
  EXPECT_TRUE(assembler.uses(60'000 * kMs, 60'000 * kMs)) << "the camera had gone for a minute";
  EXPECT_TRUE(assembler.uses(62'000 * kMs, 60'200 * kMs)) << "a frame each 2 s, ten times as fast";
  EXPECT_TRUE(assembler.uses(64'000 * kMs, 60'400 * kMs));
}

TEST(FrameAssembler, ABadMessageIsRefusedAndLosesNothing) {
  FrameAssembler assembler(without_color(), {});
  ASSERT_TRUE(assembler.add_camera_info(camera_info(), 1).ok());
  ASSERT_TRUE(assembler.add_tf(transform("camera", 0, 1.0), 2, true).ok());
  interfaces::RosImage broken = depth_at(100 * kMs);
  broken.data.resize(5);
  EXPECT_EQ(assembler.add_depth(broken, 3, 100 * kMs).code(), core::StatusCode::kInvalidInput);
  interfaces::RosCameraInfo uncalibrated = camera_info();
  uncalibrated.k.fill(0.0);
  EXPECT_FALSE(assembler.add_camera_info(uncalibrated, 4).ok());
  ASSERT_TRUE(assembler.add_depth(depth_at(110 * kMs), 5, 110 * kMs).ok());
  EXPECT_TRUE(assembler.take(111 * kMs).has_value());
}

/// 64 x 48 pixels, with a pattern that shows where each came from.
interfaces::RosImage patterned_depth(core::TimeNs stamp_ns) {
  geometry::DepthImage depth(64, 48);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) depth(x, y) = 0.5F + 0.001F * static_cast<float>(64 * y + x);
  }
  return interfaces::to_ros_image_16uc1(depth, header(stamp_ns));
}

const geometry::PinholeCamera kLensCamera{64, 48, 60.0, 62.0, 31.2, 23.7};

geometry::LensDistortion barrel() {
  return *geometry::LensDistortion::brown({-0.3, 0.1, 0.001, -0.002, 0.05, 0.0, 0.0, 0.0});
}

class AssemblerBehindALens : public testing::Test {
 protected:
  std::optional<AssembledFrame> frame(AssemblerSettings settings, const interfaces::RosCameraInfo& info) {
    settings.X_WC = geometry::Pose::identity();
    FrameAssembler assembler(settings, {});
    EXPECT_EQ(assembler.lens_text(), "");
    EXPECT_TRUE(assembler.add_camera_info(info, 1).ok());
    EXPECT_TRUE(assembler.add_depth(patterned_depth(100 * kMs), 2, 100 * kMs).ok());
    const geometry::ColorImage color(64, 48, {1, 2, 3});
    EXPECT_TRUE(assembler.add_color(interfaces::to_ros_image(color, header(100 * kMs)), 3, 100 * kMs).ok());
    auto frame = assembler.take(200 * kMs);
    lens_text_ = assembler.lens_text();
    return frame;
  }
  geometry::DepthImage raw_ = *interfaces::to_depth_image(patterned_depth(0));
  std::string lens_text_;
};

TEST_F(AssemblerBehindALens, StraightensItsImages) {
  const auto frame = this->frame({}, interfaces::to_ros_camera_info(kLensCamera, header(0), barrel()));
  ASSERT_TRUE(frame.has_value());
  EXPECT_TRUE(frame->doubts.empty());
  EXPECT_EQ(frame->observation.frame.camera, kLensCamera);
  const auto warp = interfaces::LensWarp::undistorting(kLensCamera, barrel());
  EXPECT_EQ(*frame->observation.frame.depth, *warp.depth(raw_));
  EXPECT_EQ((*frame->observation.frame.color)(20, 20), (geometry::Rgb{1, 2, 3}));
  EXPECT_EQ(lens_text_, "'plumb_bob', images are straightened here");
}

TEST_F(AssemblerBehindALens, UsesTheCalibrationOfTheFrame) {
  AssemblerSettings settings = without_color();
  settings.X_WC = geometry::Pose::identity();
  FrameAssembler assembler(settings, {});
  MessageIndex index = 0;
  for (const geometry::LensDistortion& lens : {barrel(), geometry::LensDistortion(), barrel()}) {
    const core::TimeNs now_ns = 100 * kMs * (index + 1);
    ASSERT_TRUE(assembler.add_camera_info(interfaces::to_ros_camera_info(kLensCamera, header(0), lens), ++index).ok());
    ASSERT_TRUE(assembler.add_depth(patterned_depth(now_ns), ++index, now_ns).ok());
    const auto frame = assembler.take(now_ns);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(*frame->observation.frame.depth, *interfaces::LensWarp::undistorting(kLensCamera, lens).depth(raw_));
  }
}

TEST_F(AssemblerBehindALens, LeavesRectifiedImagesAsTheyAre) {
  // The camera info of rectified images still holds the lens of the raw ones.
  interfaces::RosCameraInfo info = interfaces::to_ros_camera_info(kLensCamera, header(0), barrel());
  info.p[0] = 55.0;
  AssemblerSettings settings;
  settings.rectified = true;
  const auto frame = this->frame(settings, info);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->observation.frame.camera.fx, 55.0);
  EXPECT_EQ(*frame->observation.frame.depth, raw_);
  EXPECT_TRUE(frame->doubts.empty());
  EXPECT_EQ(lens_text_, "images are rectified already, D is not used");
}

TEST_F(AssemblerBehindALens, SaysWhichLensesItDoesNotKnow) {
  interfaces::RosCameraInfo info = interfaces::to_ros_camera_info(kLensCamera, header(0), barrel());
  info.distortion_model = "omnidirectional";
  const auto frame = this->frame({}, info);
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(*frame->observation.frame.depth, raw_);
  ASSERT_EQ(frame->doubts.size(), 1u);
  EXPECT_NE(frame->doubts[0].find("'omnidirectional' with 5 coefficients is unknown"), std::string::npos);
  EXPECT_EQ(lens_text_, "distortion ignored");
}

TEST_F(AssemblerBehindALens, DoubtsALensThatShowsLittle) {
  const auto lens = *geometry::LensDistortion::brown({-8.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  const auto frame = this->frame({}, interfaces::to_ros_camera_info(kLensCamera, header(0), lens));
  ASSERT_TRUE(frame.has_value());
  ASSERT_EQ(frame->doubts.size(), 1u);
  EXPECT_NE(frame->doubts[0].find("% of the straightened image; check the calibration"), std::string::npos);
}

}  // namespace
}  // namespace prescene::service
