// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/service_health.h"

#include <gmock/gmock.h>

namespace prescene::service {
namespace {

using interfaces::RosDiagnosticLevel;
using ::testing::HasSubstr;
using ::testing::Not;

RosDiagnosticLevel level(const ServiceHealth& health) {
  return static_cast<RosDiagnosticLevel>(to_diagnostic(health, "here").level);
}

TEST(ServiceHealth, SaysWhatItWaitsForAndWhyFramesAreOfNoUse) {
  ServiceHealth health;
  health.depth_topic = "/camera/depth";
  EXPECT_EQ(level(health), RosDiagnosticLevel::kWarn);
  EXPECT_THAT(health_text(health), HasSubstr("/camera/depth"));
  health.last_skip = "tf does not connect world to lens";
  health.last_refusal = "/tf: not a unit quaternion";
  EXPECT_FALSE(is_tracking(health));
  EXPECT_THAT(health_text(health), HasSubstr("tf does not connect world to lens"));
  EXPECT_THAT(health_text(health), HasSubstr("not a unit quaternion"));
}

TEST(ServiceHealth, IsWellWhileFramesComeAndAnErrorWhenTheyStop) {
  ServiceHealth health;
  health.seconds_since_frame = 0.1;
  health.last_refusal = "long ago";
  EXPECT_EQ(level(health), RosDiagnosticLevel::kOk);
  EXPECT_EQ(health_text(health), "tracking");
  health.degraded = {"few pixels"};
  EXPECT_EQ(level(health), RosDiagnosticLevel::kWarn);
  EXPECT_THAT(health_text(health), HasSubstr("few pixels"));
  health.seconds_since_frame = 2.0 * kSilentAfter;
  EXPECT_FALSE(is_tracking(health));
  EXPECT_EQ(level(health), RosDiagnosticLevel::kError);
  EXPECT_THAT(health_text(health), Not(HasSubstr("tracking")));
}

TEST(ServiceHealth, CarriesItsCounts) {
  ServiceHealth health;
  health.steps = 3;
  health.skipped_frames = 5;
  health.lost_on_bus = 7;
  health.questions = {11, 13, 17, 19, 2, "no"};
  health.unreadable_questions = 1;
  health.failures = 4;
  health.not_simulated = 111;
  health.physics_failure = "no simulator could be made";
  health.steppers = {13, 17, "the scene has 5"};
  const auto status = to_diagnostic(health, "here");
  EXPECT_EQ(status.hardware_id, "here");
  const std::vector<interfaces::RosKeyValue> some = {{"steps", "3"},
                                                     {"skipped frames", "5"},
                                                     {"lost on the bus", "7"},
                                                     {"questions answered", "11"},
                                                     {"questions refused", "13"},
                                                     {"questions without an answer", "18"},
                                                     {"failures", "6"},
                                                     {"particles without physics", "111"},
                                                     {"last failure of physics", "no simulator could be made"},
                                                     {"simulators in lockstep", "13"},
                                                     {"simulators on Bullet instead", "17"},
                                                     {"last reason for Bullet", "the scene has 5"}};
  for (const auto& value : some) EXPECT_THAT(status.values, ::testing::Contains(value)) << value.key;
}

TEST(ServiceHealth, TellsOfEveryLossByItsPlace) {
  ServiceHealth health;
  health.dropped_in_inbox = {{"/tf", 12}, {"/camera/depth", 3}};
  health.unsent = 4;
  health.failures = 1;
  health.unlogged = 900;
  health.tf_forgotten = 6;
  const auto status = to_diagnostic(health, "here");
  const std::vector<interfaces::RosKeyValue> some = {{"dropped in the inbox", "15"},
                                                     {"dropped by topic", "/camera/depth 3, /tf 12"},
                                                     {"not sent", "4"},
                                                     {"failures", "1"},
                                                     {"lines not logged", "900"},
                                                     {"transforms forgotten early", "6"},
                                                     {"recording", "off"}};
  for (const auto& value : some) EXPECT_THAT(status.values, ::testing::Contains(value)) << value.key;
}

TEST(ServiceHealth, AFailedRecordingIsAnErrorHoweverWellItTracks) {
  ServiceHealth health;
  health.seconds_since_frame = 0.1;
  health.is_recording = true;
  EXPECT_EQ(level(health), RosDiagnosticLevel::kOk);
  health.is_recording = false;
  health.recording_failure = "run.mcap: no space left";
  EXPECT_EQ(level(health), RosDiagnosticLevel::kError);
  EXPECT_THAT(health_text(health), HasSubstr("run.mcap: no space left"));
  EXPECT_THAT(to_diagnostic(health, "here").values,
              ::testing::Contains(interfaces::RosKeyValue{"recording", "failed: run.mcap: no space left"}));
}

}  // namespace
}  // namespace prescene::service
