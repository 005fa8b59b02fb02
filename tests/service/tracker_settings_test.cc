// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/tracker_settings.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace prescene::service {
namespace {

using nlohmann::ordered_json;
using ::testing::HasSubstr;

TrackerSettings unusual() {
  TrackerSettings settings;
  settings.topics = {"/d", "/c", "/i", "/t", "/ts", "/js", "points", "compressed", "/clock"};
  AssemblerSettings& assembler = settings.assembler;
  assembler.world_frame = "base";
  assembler.camera_frame = "lens";
  assembler.X_WC = geometry::normalized(geometry::Pose{{0.3, 0.1, -0.7, 0.2}, {0.1, 1.0 / 3.0, 2}});
  assembler.max_wait_s = 0.07;
  assembler.max_stamp_difference_s = 0.02;
  assembler.use_color = false;
  assembler.rectified = true;
  assembler.mono16_is_depth = true;
  settings.tf = {.history_s = 12.5, .max_frames = 77, .max_samples = 5000, .max_extrapolation_s = 0.3};
  settings.learned = "learned: {}\n";
  settings.learned_file = "learned.yaml";
  settings.new_objects = true;
  return settings;
}

TEST(TrackerSettings, ComeBackAsTheSameBits) {
  const std::string text = to_json(unusual()).dump();
  const auto read = with_recorded({}, ordered_json::parse(text));
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(to_json(*read).dump(), text);
  EXPECT_EQ(read->topics, unusual().topics);
  EXPECT_EQ(*read->assembler.X_WC, *unusual().assembler.X_WC);
  EXPECT_EQ(read->assembler.max_wait_s, 0.07);
  EXPECT_EQ(read->assembler.rectified, true);
  EXPECT_EQ(read->tf.max_frames, 77);
  EXPECT_EQ(read->tf.max_samples, 5000);
  // Every key says something: without it the default stays.
  const ordered_json whole = to_json(unusual());
  const ordered_json defaults = to_json(TrackerSettings{});
  for (const auto& [key, value] : whole.items()) EXPECT_NE(value, defaults.at(key)) << key;
}

TEST(TrackerSettings, SayWhetherImagesAreRectifiedOrTheirTopicDoes) {
  TrackerSettings settings;
  EXPECT_FALSE(is_rectified(settings));
  EXPECT_EQ(rectified_doubt(settings), "");
  settings.topics.depth = "/camera/depth_registered/image_rect";
  EXPECT_TRUE(is_rectified(settings));
  EXPECT_THAT(rectified_doubt(settings), HasSubstr("one of /camera/depth_registered/image_rect and /camera/color"));
  settings.topics.color = "/camera/rgb/image_rect_color";
  EXPECT_EQ(rectified_doubt(settings), "");
  settings.topics.color = "";
  EXPECT_EQ(rectified_doubt(settings), "") << "without colour there is no other";
  settings.assembler.rectified = false;
  EXPECT_FALSE(is_rectified(settings));
  settings.topics.color = "/camera/color/image_raw";
  EXPECT_EQ(rectified_doubt(settings), "");
  EXPECT_EQ(with_recorded({}, to_json(settings))->assembler.rectified, false);
  EXPECT_EQ(with_recorded(settings, {{"rectified", nullptr}})->assembler.rectified, std::nullopt);
}

TEST(TrackerSettings, OfOtherVersionsAreTakenAsFarAsTheyGo) {
  const auto read = with_recorded(unusual(), {{"world_frame", "map"}, {"something_new", {1, 2}}});
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->assembler.world_frame, "map");
  EXPECT_EQ(read->topics, unusual().topics);
}

TEST(TrackerSettings, RefuseWhatIsNoSettingAndNameIt) {
  const ordered_json whole = to_json(unusual());
  for (const auto& [key, value] : whole.items()) {
    for (const ordered_json& wrong : {ordered_json{{"a", 1}}, ordered_json(-1), ordered_json("1e999")}) {
      if (value.is_string() && wrong.is_string()) continue;
      const auto read = with_recorded({}, {{key, wrong}});
      ASSERT_FALSE(read.ok()) << key << " = " << wrong;
      EXPECT_THAT(read.status().message(), HasSubstr(key));
    }
  }
  EXPECT_FALSE(with_recorded({}, ordered_json::array()).ok());
}

}  // namespace
}  // namespace prescene::service
