// SPDX-License-Identifier: Apache-2.0
// Where the settings name a clock topic, only its messages make time go on.
#include <gtest/gtest.h>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/tracking/tracker.h"
#include "recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::simulated_time_test {
namespace {

constexpr core::TimeNs kMs = 1'000'000;
constexpr core::TimeNs kHour = 3'600'000 * kMs;

class SimulatedTime : public ::testing::Test {
 protected:
  void SetUp() override {
    const tests::ScratchDir folder;
    const std::filesystem::path path = folder.path() / "run.mcap";
    const std::string yaml = tests::box_on_table("0.5");
    const auto scene = load_scene_text(yaml, "box.yaml", {});
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    const core::Status recorded = tests::record_scene(yaml, {}, 10.0, path);
    ASSERT_TRUE(recorded.ok()) << recorded.message();
    const auto reader = RecordingReader::open(path);
    ASSERT_TRUE(reader.ok());
    for (;;) {
      const auto entry = (*reader)->next();
      ASSERT_TRUE(entry.ok());
      if (!*entry) break;
      const interfaces::ReceivedMessage& message = (*entry)->message;
      if ((*entry)->is_json) continue;
      (message.topic == settings_.topics.depth || message.topic == settings_.topics.color ? images_ : others_)
          .push_back(message);
    }
    settings_.topics.clock = kClockTopic;
    auto tracker = Tracker::create(*scene, settings_, 1, backends_);
    ASSERT_TRUE(tracker.ok()) << tracker.status().message();
    tracker_ = *std::move(tracker);
    for (const interfaces::ReceivedMessage& message : others_) ASSERT_TRUE(take_in(message));
    for (const interfaces::ReceivedMessage& message : images_) {
      if (message.topic == settings_.topics.depth) depths_.push_back(message);
    }
    ASSERT_GE(depths_.size(), 4u);
  }

  bool take_in(interfaces::ReceivedMessage message) {
    // When it came by a real clock plays no part.
    message.received_ns = (index_ % 2 == 0 ? 1 : -1) * static_cast<core::TimeNs>(index_) * kHour;
    const core::Status taken = tracker_->take_in(message, index_++);
    EXPECT_TRUE(taken.ok()) << taken.message();
    return taken.ok();
  }
  /// The clock says so many ms.
  bool tick(core::TimeNs ms) {
    return take_in({kClockTopic, "rosgraph_msgs/msg/Clock",
                    interfaces::encode_cdr(interfaces::RosClock{interfaces::to_ros_time(ms * kMs)}), 0, 0});
  }
  bool control(const std::string& json, core::TimeNs sent_ns) {
    return take_in(
        {kControlTopic, "std_msgs/msg/String", interfaces::encode_cdr(interfaces::RosString{json}), sent_ns, sent_ns});
  }
  /// A step, whatever a real clock says.
  std::optional<TrackerStep> step() { return tracker_->step(static_cast<core::TimeNs>(index_) * kHour); }

  TrackerSettings settings_;
  core::ThreadPool pool_{1};
  Backends backends_{pool_};
  std::vector<interfaces::ReceivedMessage> others_, images_, depths_;
  std::unique_ptr<Tracker> tracker_;
  MessageIndex index_ = 0;
};

TEST_F(SimulatedTime, AFrameWaitsForItsColourByTheClock) {
  ASSERT_TRUE(take_in(depths_[0]));
  EXPECT_FALSE(step()) << "time stands still before the clock comes";
  ASSERT_TRUE(tick(49));
  EXPECT_FALSE(step());
  EXPECT_FALSE(tracker_->next_deadline()) << "no real time brings it on";
  ASSERT_TRUE(tick(50));
  EXPECT_EQ(tracker_->simulated_now_ns(), 50 * kMs);
  const auto made = step();
  ASSERT_TRUE(made);
  EXPECT_FALSE(made->record.color);

  // Complete, it waits for nothing.
  for (const interfaces::ReceivedMessage& message : images_) {
    if (message.source_ns == depths_[1].source_ns) {
      ASSERT_TRUE(take_in(message));
    }
  }
  const auto next = step();
  ASSERT_TRUE(next);
  EXPECT_TRUE(next->record.color);
}

TEST_F(SimulatedTime, AFrameDoesNotWaitForATimeThatASimulationLeft) {
  ASSERT_TRUE(tick(1'000'000));
  ASSERT_TRUE(take_in(depths_[0]));
  EXPECT_FALSE(step());
  ASSERT_TRUE(tick(0));
  EXPECT_TRUE(step());
}

TEST_F(SimulatedTime, AControlWithoutAStampIsOfTheTimeOfTheClock) {
  const auto stamp_ms = [&](std::size_t i) {
    const auto image = interfaces::decode_cdr<interfaces::RosImage>(depths_[i].cdr);
    return *interfaces::to_stamp_ns(image->header.stamp) / kMs;
  };
  const auto idle_at = [&](std::size_t i) {
    EXPECT_TRUE(take_in(depths_[i]));
    EXPECT_TRUE(tick(stamp_ms(i) + 120));
    const auto made = step();
    EXPECT_TRUE(made) << i;
    return made ? made->idle_controls.count : 0;
  };
  ASSERT_TRUE(tick(stamp_ms(0)));
  EXPECT_EQ(idle_at(0), 0u);
  // Nothing holds the box: the step that the release is due in tells of it. Sent in the time of the third frame, an
  // hour and more away by the real clock.
  ASSERT_TRUE(tick(stamp_ms(1) + 50));
  ASSERT_TRUE(control(R"({"actions": [{"time": 0, "release": {"object": "box"}}]})", kHour));
  EXPECT_EQ(idle_at(1), 0u) << "due later";
  EXPECT_EQ(idle_at(2), 1u);
}

TEST_F(SimulatedTime, ANegativeTimeIsRefused) {
  const core::Status refused = tracker_->take_in(
      {kClockTopic, "rosgraph_msgs/msg/Clock", interfaces::encode_cdr(interfaces::RosClock{{-1, 0}}), 0, 0}, index_++);
  EXPECT_EQ(refused.code(), core::StatusCode::kInvalidInput);
  EXPECT_EQ(tracker_->simulated_now_ns(), 0);
}

}  // namespace
}  // namespace prescene::service::simulated_time_test
