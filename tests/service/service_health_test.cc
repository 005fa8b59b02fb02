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
  health.failed_steps = 4;
  const auto status = to_diagnostic(health, "here");
  EXPECT_EQ(status.hardware_id, "here");
  const std::vector<interfaces::RosKeyValue> some = {{"steps", "3"},
                                                     {"skipped frames", "5"},
                                                     {"lost on the bus", "7"},
                                                     {"questions answered", "11"},
                                                     {"questions refused", "13"},
                                                     {"questions without an answer", "18"},
                                                     {"failures", "6"}};
  for (const auto& value : some) EXPECT_THAT(status.values, ::testing::Contains(value)) << value.key;
}

}  // namespace
}  // namespace prescene::service
