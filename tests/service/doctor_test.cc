// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/doctor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/service/robot_on_bus.h"
#include "tests/support/bus_domain.h"

namespace prescene::service::doctor_test {
namespace {

using testing::HasSubstr;

const DoctorCheck* find(const Diagnosis& diagnosis, const std::string& name) {
  for (const DoctorCheck& check : diagnosis.checks)
    if (check.name == name) return &check;
  return nullptr;
}

class DoctorTest : public ::testing::Test {
 protected:
  DoctorTest() {
    const auto scene = load_scene_text(tests::kBoxScene, "box.yaml", {});
    if (scene) scene_ = *scene;
    options_.dds.domain = tests::own_domain();
    options_.seconds = 1.0;
  }
  core::Result<Diagnosis> examine() { return examine_bus(options_, scene_, backends_, {}, {}, {}); }
  /// The same while the robot sends frames, until one could be used: on a busy machine the first may take its time.
  core::Result<Diagnosis> examine(tests::RobotOnBus& robot) {
    std::atomic<bool> done = false;
    std::thread sender([&] { robot.send_until([&] { return done.load(); }, core::wall_now_ns()); });
    core::Result<Diagnosis> diagnosis = examine();
    for (int i = 0; i < 20 && diagnosis && !diagnosis->frame; ++i) diagnosis = examine();
    done = true;
    sender.join();
    return diagnosis;
  }

  core::ThreadPool pool_{1};
  Backends backends_{pool_};
  std::shared_ptr<const belief::Scene> scene_;
  DoctorOptions options_;
};

TEST_F(DoctorTest, FindsARobotUsableAndDrawsTheScene) {
  ASSERT_NE(scene_, nullptr);
  tests::RobotOnBus robot(tests::kBoxScene, tests::own_domain());
  ASSERT_TRUE(robot.good());
  const auto diagnosis = examine(robot);
  ASSERT_TRUE(diagnosis.ok()) << diagnosis.status().message();
  for (const DoctorCheck& check : diagnosis->checks)
    EXPECT_NE(check.status, CheckStatus::kError) << check.name << ": " << check.what;
  EXPECT_TRUE(diagnosis->usable());
  ASSERT_TRUE(diagnosis->frame.has_value());
  EXPECT_EQ(diagnosis->overlay.width(), 80);
  const DoctorCheck* view = find(*diagnosis, "view");
  ASSERT_NE(view, nullptr);
  EXPECT_EQ(view->status, CheckStatus::kOk) << view->what;
  bool found = false;
  for (const ExaminedTopic& row : diagnosis->topics) {
    if (row.topic.name != InputTopics().depth) continue;
    found = true;
    EXPECT_EQ(row.topic.type, "sensor_msgs/msg/Image");
    EXPECT_EQ(row.topic.writers, 1);
    EXPECT_GT(row.messages, 0u);
  }
  EXPECT_TRUE(found);
}

TEST_F(DoctorTest, SeesATableThatIsNotWhereTheSceneFileSays) {
  ASSERT_NE(scene_, nullptr);
  belief::Scene lower = *scene_;
  lower.supports[0].X_WS.translation.z() -= 0.08;
  scene_ = std::make_shared<const belief::Scene>(lower);
  tests::RobotOnBus robot(tests::kBoxScene, tests::own_domain());
  ASSERT_TRUE(robot.good());
  const auto diagnosis = examine(robot);
  ASSERT_TRUE(diagnosis.ok()) << diagnosis.status().message();
  const DoctorCheck* view = find(*diagnosis, "view");
  ASSERT_NE(view, nullptr);
  EXPECT_EQ(view->status, CheckStatus::kWarning);
  EXPECT_THAT(view->remedy, HasSubstr("--overlay"));
}

TEST_F(DoctorTest, SaysThatNothingComes) {
  options_.seconds = 0.5;
  const auto diagnosis = examine();
  ASSERT_TRUE(diagnosis.ok()) << diagnosis.status().message();
  EXPECT_FALSE(diagnosis->usable());
  const DoctorCheck* depth = find(*diagnosis, "depth image");
  ASSERT_NE(depth, nullptr);
  EXPECT_EQ(depth->status, CheckStatus::kError);
  EXPECT_THAT(depth->what, HasSubstr("no depth image on " + InputTopics().depth));
  EXPECT_FALSE(diagnosis->frame.has_value());
}

TEST_F(DoctorTest, SaysHowSimulatedTimeGoesAndThatItIsTold) {
  {
    options_.seconds = 0.5;
    options_.tracker.topics.clock = kClockTopic;
    const auto diagnosis = examine();
    ASSERT_TRUE(diagnosis.ok());
    const DoctorCheck* check = find(*diagnosis, "simulated time");
    ASSERT_NE(check, nullptr);
    EXPECT_EQ(check->status, CheckStatus::kError);
    EXPECT_EQ(check->what, "nothing has come on /clock");
  }
  tests::RobotOnBus robot(tests::kBoxScene, tests::own_domain());
  ASSERT_TRUE(robot.good());
  robot.send_clock(0);
  for (const std::string clock : {kClockTopic, ""}) {
    options_.tracker.topics.clock = clock;
    std::atomic<bool> done = false;
    std::thread sender([&] {
      for (core::TimeNs time_ns = 0; !done; time_ns += 10'000'000) {
        robot.send_clock(time_ns);
        robot.wait(std::chrono::milliseconds(10));
      }
    });
    const auto is_found = [&](const core::Result<Diagnosis>& diagnosis) {
      const DoctorCheck* check = diagnosis ? find(*diagnosis, "simulated time") : nullptr;
      return check != nullptr && check->status == (clock.empty() ? CheckStatus::kWarning : CheckStatus::kOk);
    };
    bool found = false;
    for (int i = 0; i < 20 && !found; ++i) found = is_found(examine());
    EXPECT_TRUE(found) << clock;
    done = true;
    sender.join();
  }
}

TEST_F(DoctorTest, StopsOnRequest) {
  options_.seconds = 600.0;
  core::Cancellation cancellation;
  cancellation.request();
  EXPECT_EQ(examine_bus(options_, nullptr, backends_, cancellation, {}, {}).status().code(),
            core::StatusCode::kCancelled);
}

}  // namespace
}  // namespace prescene::service::doctor_test
