// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/service_health.h"

#include <gmock/gmock.h>

#include <functional>
#include <string>
#include <vector>

namespace prescene::service {
namespace {

using interfaces::RosDiagnosticLevel;
using ::testing::HasSubstr;
using ::testing::Not;

RosDiagnosticLevel level(const ServiceHealth& health, const ServiceHealth& before = {}) {
  return static_cast<RosDiagnosticLevel>(to_diagnostic(health, before, "here").level);
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

TEST(ServiceHealth, SaysWhatImagesThereAreWhereNoneComes) {
  ServiceHealth health;
  health.depth_topic = "/camera/depth";
  health.nothing_came = "no depth image on /camera/depth; image topics in DDS domain 0: /a (Image)";
  EXPECT_EQ(health_text(health), health.nothing_came);
  EXPECT_EQ(to_diagnostic(health, {}, "here").message, health.nothing_came);
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
  health.waiting_controls = 23;
  health.dropped_controls = 29;
  health.questions = {11, 13, 17, 19, 31, 2, "no", 5};
  health.unreadable_questions = 1;
  health.refused_requests = 37;
  health.failures = 4;
  health.not_simulated = 111;
  health.physics_failure = "no simulator could be made";
  health.steppers = {13, 17, "the scene has 5"};
  const auto status = to_diagnostic(health, {}, "here");
  EXPECT_EQ(status.hardware_id, "here");
  const std::vector<interfaces::RosKeyValue> some = {{"steps", "3"},
                                                     {"skipped frames", "5"},
                                                     {"lost on the bus", "7"},
                                                     {"controls waiting", "23"},
                                                     {"controls dropped", "29"},
                                                     {"questions answered", "11"},
                                                     {"questions refused", "13"},
                                                     {"questions without an answer", "18"},
                                                     {"questions repeated", "19"},
                                                     {"requests for parameters refused", "37"},
                                                     {"failures", "6"},
                                                     {"particles without physics", "111"},
                                                     {"last failure of physics", "no simulator could be made"},
                                                     {"simulators in lockstep", "13"},
                                                     {"simulators on Bullet instead", "17"},
                                                     {"last reason for Bullet", "the scene has 5"}};
  for (const auto& value : some) EXPECT_THAT(status.values, ::testing::Contains(value)) << value.key;
}

TEST(ServiceHealth, WarnsAsLongAsThereAreOtherServices) {
  ServiceHealth health;
  health.seconds_since_frame = 0.1;
  health.other_services = 2;
  EXPECT_EQ(level(health, health), RosDiagnosticLevel::kWarn);
  EXPECT_THAT(health_text(health), HasSubstr("2 other services publish in this DDS domain"));
  EXPECT_THAT(health_text(health), HasSubstr("--domain"));
}

TEST(ServiceHealth, TellsOfEveryLossByItsPlace) {
  ServiceHealth health;
  health.dropped_in_inbox = {{"/tf", 12}, {"/camera/depth", 3}};
  health.unsent = 4;
  health.failures = 1;
  health.unlogged = 900;
  health.tf_forgotten = 6;
  health.tf_late = 8;
  health.recording.interruptions = 2;
  health.recording.tries = 31;
  health.recording.lost_messages = 777;
  health.recording.first_failure = "run.mcap: no space left";
  health.recording.not_repeated = 41;
  health.recording.unfinished = 43;
  health.recording.last_unfinished = "out of memory";
  const auto status = to_diagnostic(health, {}, "here");
  const std::vector<interfaces::RosKeyValue> some = {{"recording interrupted", "2"},
                                                     {"first interruption", "run.mcap: no space left"},
                                                     {"tries to go on recording", "31"},
                                                     {"messages not recorded", "777"},
                                                     {"messages not repeated", "41"},
                                                     {"recording jobs unfinished", "43"},
                                                     {"last unfinished recording job", "out of memory"},
                                                     {"recorded files", "0"},
                                                     {"dropped in the inbox", "15"},
                                                     {"dropped by topic", "/camera/depth 3, /tf 12"},
                                                     {"not sent", "4"},
                                                     {"failures", "1"},
                                                     {"lines not logged", "900"},
                                                     {"transforms forgotten early", "6"},
                                                     {"transforms too late", "8"},
                                                     {"recording", "off"}};
  for (const auto& value : some) EXPECT_THAT(status.values, ::testing::Contains(value)) << value.key;
}

TEST(ServiceHealth, WarnsOfWhatWasLostSinceTheLastReportAndNotForEver) {
  ServiceHealth quiet;
  quiet.seconds_since_frame = 0.1;
  quiet.image_topics = {"/camera/depth"};
  const std::vector<std::function<void(ServiceHealth&)>> losses = {
      [](ServiceHealth& health) { ++health.failures; },
      [](ServiceHealth& health) { ++health.questions.failed; },
      [](ServiceHealth& health) { ++health.questions.unanswered; },
      [](ServiceHealth& health) { ++health.unreadable_questions; },
      [](ServiceHealth& health) { ++health.refused_requests; },
      [](ServiceHealth& health) { ++health.lost_on_bus; },
      [](ServiceHealth& health) { ++health.unsent; },
      [](ServiceHealth& health) { ++health.tf_forgotten; },
      [](ServiceHealth& health) { ++health.tf_late; },
      [](ServiceHealth& health) { ++health.recording.interruptions; },
      [](ServiceHealth& health) { ++health.recording.lost_messages; },
      [](ServiceHealth& health) { ++health.dropped_controls; },
      [](ServiceHealth& health) { ++health.idle_controls; },
      [](ServiceHealth& health) { ++health.dropped_in_inbox["/tf"]; }};
  for (std::size_t i = 0; i < losses.size(); ++i) {
    ServiceHealth health = quiet;
    losses[i](health);
    EXPECT_EQ(level(health, quiet), RosDiagnosticLevel::kWarn) << i;
    EXPECT_EQ(level(health, health), RosDiagnosticLevel::kOk) << i;
  }
  ServiceHealth busy = quiet;
  busy.dropped_in_inbox["/camera/depth"] = 3;  // newer ones came
  EXPECT_EQ(level(busy, quiet), RosDiagnosticLevel::kOk);
}

TEST(ServiceHealth, ShowsTheNewestFailure) {
  const auto shown = [](const ServiceHealth& health) {
    for (const auto& value : to_diagnostic(health, {}, "here").values)
      if (value.key == "last failure") return value.value;
    return std::string("none");
  };
  ServiceHealth health;
  EXPECT_EQ(shown(health), "");
  health.questions.last_failure = "of a question";
  EXPECT_EQ(shown(health), "of a question");
  health.last_failure = "of a frame";
  health.last_failure_ns = 20;
  health.questions.last_failure_ns = 10;
  EXPECT_EQ(shown(health), "of a frame");
  health.questions.last_failure_ns = 30;
  EXPECT_EQ(shown(health), "of a question");
}

TEST(ServiceHealth, WarnsWhileTheDiskDoesNotKeepUpWithTheRecording) {
  ServiceHealth health;
  health.seconds_since_frame = 0.1;
  health.is_recording = true;
  health.recording_at_risk_s = 0.9;
  EXPECT_EQ(level(health), RosDiagnosticLevel::kOk);
  health.recording_at_risk_s = 2.34;
  EXPECT_EQ(level(health), RosDiagnosticLevel::kWarn);
  EXPECT_THAT(to_diagnostic(health, {}, "here").values,
              ::testing::Contains(interfaces::RosKeyValue{
                  "recording", "on, but the disk is slow: what came in the last 2.3 s is lost if the power fails"}));
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
  EXPECT_THAT(to_diagnostic(health, {}, "here").values,
              ::testing::Contains(interfaces::RosKeyValue{"recording", "failed: run.mcap: no space left"}));
}

}  // namespace
}  // namespace prescene::service
