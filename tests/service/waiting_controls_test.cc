// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/tracking/waiting_controls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/tracking/tracker.h"
#include "tests/service/recorded_box.h"
#include "tests/support/paths.h"

namespace prescene::service::waiting_controls_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr core::TimeNs kSecond = 1'000'000'000;
constexpr core::TimeNs kNoon = 1'700'000'000 * kSecond;
constexpr const char* kGrasp = R"({"actions": [{"time": 0, "grasp": {"object": "box", "hand": "gripper"}}]})";
constexpr const char* kRelease = R"({"actions": [{"time": 0.5, "release": {"object": "box"}}]})";

interfaces::ReceivedMessage message(const std::string& json, core::TimeNs source_ns) {
  return {kControlTopic, "std_msgs/msg/String", interfaces::encode_cdr(interfaces::RosString{json}), source_ns, 5};
}

std::string stamped(core::TimeNs stamp_ns) {
  return R"({"stamp_ns": )" + std::to_string(stamp_ns) + R"(, "actions": [{"time": 0, "release": {"object": "box"}}]})";
}

std::vector<std::string> kinds(const belief::Control& control) {
  std::vector<std::string> kinds;
  for (const belief::Action& action : control.actions) kinds.push_back(belief::kind_of(action));
  return kinds;
}

TEST(WaitingControls, GiveWhatIsDueInItsOrderAndKeepTheRest) {
  WaitingControls controls;
  ASSERT_TRUE(controls.take_in(message(kRelease, kNoon), kNoon).ok());
  ASSERT_TRUE(controls.take_in(message(kGrasp, kNoon + kSecond / 10), kNoon).ok());
  EXPECT_THAT(kinds(controls.due(kNoon, kNoon + kSecond / 5)), ElementsAre("grasp"));
  controls.forget_due(kNoon + kSecond / 5);
  EXPECT_EQ(controls.count(), 1u);
  const belief::Control later = controls.due(kNoon + kSecond / 5, kNoon + kSecond);
  EXPECT_THAT(kinds(later), ElementsAre("release"));
  EXPECT_NEAR(later.actions[0].time, 0.3, 1e-9);
}

TEST(WaitingControls, AreReadBackFromTheirJson) {
  WaitingControls controls;
  ASSERT_TRUE(controls.take_in(message(stamped(kNoon + kSecond / 3), kNoon), kNoon).ok());
  ASSERT_TRUE(controls.take_in(message(kGrasp, kNoon + 7), kNoon).ok());
  ASSERT_TRUE(controls
                  .take_in(message(R"({"actions": [{"time": 0.1, "place": {"object": "box",
                      "pose": {"position": [0, 0, 0.1]}, "duration": 0.7}}]})",
                                   kNoon),
                           kNoon)
                  .ok());
  const auto json = nlohmann::ordered_json::parse(controls.to_json().dump());
  auto read = WaitingControls::from_json(json);
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->to_json(), controls.to_json());
  // They go on alike, also where a release takes the place of how the placement ends, and where a restart comes.
  for (WaitingControls* both : {&controls, &*read}) {
    EXPECT_THAT(kinds(both->due(kNoon, kNoon + kSecond)), ElementsAre("grasp", "release", "release"));
    ASSERT_TRUE(both->take_in(message(kRelease, kNoon), kNoon).ok());
    EXPECT_THAT(kinds(both->due(kNoon, kNoon + kSecond)), ElementsAre("grasp", "release", "release"));
    ASSERT_TRUE(both->take_in(message(R"({"restart": true})", kNoon), kNoon).ok());
  }
  EXPECT_TRUE(WaitingControls::from_json(controls.to_json())->take_restart());
  for (const char* key : {"waiting", "dropped", "restarts"}) {
    nlohmann::ordered_json without = json;
    without.erase(key);
    EXPECT_THAT(WaitingControls::from_json(without).status().message(), HasSubstr(key));
  }
  for (const char* key : {"due_ns", "after_ns", "sent_ns", "action", "ends_place"}) {
    nlohmann::ordered_json without = json;
    without["waiting"][0].erase(key);
    EXPECT_THAT(WaitingControls::from_json(without).status().message(), HasSubstr(key));
  }
}

TEST(WaitingControls, APlaceReleasesItsObjectAtItsEndAndOnce) {
  const std::string place = R"({"actions": [{"time": 0.5, "place": {"object": "box",
      "pose": {"position": [0, 0, 0.1]}, "duration": 1.5}}]})";
  WaitingControls controls;
  ASSERT_TRUE(controls.take_in(message(place, kNoon), kNoon).ok());
  EXPECT_THAT(kinds(controls.due(kNoon, kNoon + kSecond)), ElementsAre());
  const belief::Control end = controls.due(kNoon + kSecond, kNoon + 2 * kSecond);
  EXPECT_THAT(kinds(end), ElementsAre("release"));
  EXPECT_NEAR(end.actions[0].time, 1.0, 1e-9);
  EXPECT_EQ(belief::object_of(end.actions[0]), "box");

  // The robot says itself when it lets go.
  ASSERT_TRUE(controls.take_in(message(kRelease, kNoon + kSecond), kNoon).ok());
  EXPECT_THAT(kinds(controls.due(kNoon, kNoon + 9 * kSecond)), ElementsAre("release"));
  EXPECT_EQ(controls.count(), 1u);

  const std::string eternal = R"({"actions": [{"time": 0, "place": {"object": "box", "pose": {"position": [0, 0, 0]},
      "duration": 1e300}}]})";
  EXPECT_THAT(controls.take_in(message(eternal, kNoon), kNoon).message(), HasSubstr("at most an hour"));
  const std::string backwards = R"({"actions": [{"time": 0, "place": {"object": "box",
      "pose": {"position": [0, 0, 0]}, "duration": -1e300}}]})";
  EXPECT_FALSE(controls.take_in(message(backwards, kNoon), kNoon).ok());

  // Another placement is in the place of the first one.
  ASSERT_TRUE(controls.take_in(message(place, kNoon), kNoon).ok());
  ASSERT_TRUE(controls.take_in(message(place, kNoon + kSecond), kNoon).ok());
  EXPECT_THAT(kinds(controls.due(kNoon, kNoon + 9 * kSecond)), ElementsAre("release", "release"));
}

TEST(WaitingControls, BeforeTheFirstFrameCountFromItWhereTheClocksDiffer) {
  WaitingControls controls;
  ASSERT_TRUE(controls.take_in(message(kRelease, kNoon), std::nullopt).ok());
  ASSERT_TRUE(controls.take_in(message(kGrasp, kNoon + kSecond), std::nullopt).ok());
  controls.begin_at(7 * kSecond);  // simulated time
  EXPECT_THAT(kinds(controls.due(7 * kSecond, 7 * kSecond)), ElementsAre("grasp"));
  EXPECT_THAT(kinds(controls.due(7 * kSecond, 8 * kSecond)), ElementsAre("grasp", "release"));
  EXPECT_EQ(controls.dropped(), 0u);
}

TEST(WaitingControls, AStampOfAnotherClockIsRefusedWithBothTimes) {
  WaitingControls controls;
  const core::Status refused = controls.take_in(message(stamped(kNoon), kNoon), 7 * kSecond);
  EXPECT_EQ(refused.code(), core::StatusCode::kInvalidInput);
  EXPECT_THAT(refused.message(), HasSubstr("1700000000.000 s"));
  EXPECT_THAT(refused.message(), HasSubstr("7.000 s"));
  EXPECT_THAT(refused.message(), HasSubstr("leave stamp_ns out"));
  EXPECT_EQ(controls.count(), 0u);
  EXPECT_TRUE(controls.take_in(message(stamped(8 * kSecond), kNoon), 7 * kSecond).ok());
}

TEST(WaitingControls, AnEarlyStampOfAnotherClockIsDroppedAndCounted) {
  WaitingControls controls;
  ASSERT_TRUE(controls.take_in(message(stamped(kNoon), kNoon), std::nullopt).ok());
  ASSERT_TRUE(controls.take_in(message(stamped(6 * kSecond), kNoon), std::nullopt).ok());
  controls.begin_at(7 * kSecond);
  EXPECT_EQ(controls.count(), 1u);
  EXPECT_EQ(controls.dropped(), 1u);
}

TEST(WaitingControls, OutliveAClockThatGoesBack) {
  WaitingControls controls;
  ASSERT_TRUE(controls.take_in(message(kGrasp, kNoon), 5000 * kSecond).ok());
  controls.begin_again();
  controls.begin_at(7 * kSecond);
  EXPECT_THAT(kinds(controls.due(7 * kSecond, 8 * kSecond)), ElementsAre("grasp"));
}

TEST(WaitingControls, AreBounded) {
  WaitingControls controls;
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(controls.take_in(message(kGrasp, kNoon), kNoon).ok());
  EXPECT_EQ(controls.take_in(message(kGrasp, kNoon), kNoon).code(), core::StatusCode::kResourceExhausted);
}

belief::Control control_of(const std::string& actions) {
  const auto parsed = parse_control(R"({"actions": [)" + actions + "]}");
  EXPECT_TRUE(parsed.ok()) << parsed.status().message();
  belief::Control control;
  for (const auto& [after_ns, action] : parsed->actions) control.actions.push_back(action);
  return control;
}

TEST(IdleControls, AreThoseOfWhatIsNotThereOrNotHeld) {
  belief::Scene scene;
  scene.objects.resize(2);
  scene.objects[0].name = "box";
  scene.objects[1].name = "mug";
  scene.objects[1].held_by = "gripper";
  scene.robot.resize(1);
  scene.robot[0].name = "gripper";
  const std::string grasp = R"({"time": 0, "grasp": {"object": "box", "hand": "gripper"}})";
  const std::string release = R"({"time": 0, "release": {"object": "box"}})";
  const std::string pour = R"({"time": 0, "pour": {"container": "box", "angle_deg": 90}})";
  const auto idle = [&](const std::string& actions) { return idle_controls(scene, control_of(actions)); };
  EXPECT_EQ(idle(grasp + "," + pour + "," + release).count, 0u);
  EXPECT_EQ(idle(R"({"time": 0, "release": {"object": "mug"}})").count, 0u);
  EXPECT_EQ(idle(R"({"time": 0, "push": {"from": [0, 0, 0], "to": [1, 0, 0]}})").count, 0u);
  EXPECT_EQ(idle(release).last, "the action 'release' of 'box' changes nothing: nothing holds it");
  EXPECT_EQ(idle(pour).last, "the action 'pour' of 'box' changes nothing: nothing holds it");
  EXPECT_EQ(idle(grasp + "," + release + "," + release).count, 1u);
  EXPECT_EQ(idle(R"({"time": 0, "bump": {"object": "box", "impulse": [1, 0, 0]}})").last,
            "the action 'bump' of 'box' changes nothing: the tracker follows what is seen of it");
  EXPECT_EQ(idle(R"({"time": 0, "release": {"object": "cup\n"}})").last,
            R"(the action 'release' of 'cup\x0a' changes nothing: the scene has no such object)");
  EXPECT_EQ(idle(R"({"time": 0, "grasp": {"object": "box", "hand": "foot"}})").last,
            "the action 'grasp' of 'box' changes nothing: the scene has no robot body 'foot'");
}

TEST(WaitingControls, ARestartDropsWhatWaitsAndIsToldOnce) {
  WaitingControls controls;
  ASSERT_TRUE(controls.take_in(message(kRelease, kNoon), kNoon).ok());
  EXPECT_FALSE(controls.take_restart());
  ASSERT_TRUE(controls.take_in(message(R"({"restart": true})", kNoon), kNoon).ok());
  EXPECT_EQ(controls.count(), 0u);
  EXPECT_TRUE(controls.take_restart());
  EXPECT_FALSE(controls.take_restart());
  for (const char* nonsense : {R"({"restart": false})", R"({"restart": 1})", R"({"restart": true, "actions": []})"})
    EXPECT_THAT(controls.take_in(message(nonsense, kNoon), kNoon).message(), HasSubstr("restart: true")) << nonsense;
  EXPECT_FALSE(controls.take_restart());
}

TEST(Tracker, ARestartBeginsTheBeliefAnewAndSaysSo) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  core::ThreadPool pool(1);
  Backends backends(pool);
  const std::string yaml = tests::box_on_table("0.5");
  const auto scene = load_scene_text(yaml, "box.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  ASSERT_TRUE(tests::record_scene(yaml, {}, 10.0, path).ok());
  const auto tracker = Tracker::create(*scene, {}, 1, backends);
  ASSERT_TRUE(tracker.ok()) << tracker.status().message();
  const auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.ok());
  std::vector<std::uint64_t> steps;
  for (;;) {
    const auto entry = (*reader)->next();
    ASSERT_TRUE(entry.ok());
    if (!*entry) break;
    if ((*entry)->is_json) continue;
    ASSERT_TRUE((*tracker)->take_in((*entry)->message, (*entry)->index).ok());
    while (const auto step = (*tracker)->step((*entry)->message.received_ns)) {
      steps.push_back(step->record.step);
      const bool says =
          !step->record.degraded.empty() && step->record.degraded.back() == "started again, as a control asked";
      EXPECT_EQ(says, steps.size() == 4);
      if (steps.size() == 3) {
        ASSERT_TRUE((*tracker)->take_in(message(R"({"restart": true})", kNoon), 1'000'000).ok());
      }
    }
  }
  ASSERT_GE(steps.size(), 5u);
  steps.resize(5);
  EXPECT_THAT(steps, ElementsAre(1, 2, 3, 1, 2));
}

TEST(Tracker, AGraspBeforeTheFirstFrameActsInTheFirstStepThatPredicts) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  core::ThreadPool pool(1);
  Backends backends(pool);
  const std::string yaml = tests::box_on_table("0.5") + R"(robot:
  gripper: {box: [0.02, 0.02, 0.02], timeline: [{time: 0, position: [0, 0, 0.3]}]}
)";
  const auto scene = load_scene_text(yaml, "box.yaml", {});
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  const core::Status recorded = tests::record_scene(yaml, {}, 10.0, path);
  ASSERT_TRUE(recorded.ok()) << recorded.message();
  const auto tracker = Tracker::create(*scene, {}, 1, backends);
  ASSERT_TRUE(tracker.ok()) << tracker.status().message();
  ASSERT_TRUE((*tracker)->take_in(message(kGrasp, kNoon), 0).ok());
  EXPECT_EQ((*tracker)->waiting_controls(), 1u);
  const auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.ok());
  std::vector<bool> held;
  for (;;) {
    const auto entry = (*reader)->next();
    ASSERT_TRUE(entry.ok());
    if (!*entry) break;
    if ((*entry)->is_json) continue;
    ASSERT_TRUE((*tracker)->take_in((*entry)->message, (*entry)->index + 1).ok());
    while ((*tracker)->step((*entry)->message.received_ns))
      held.push_back((*tracker)->belief()->scene->objects[0].held_by == "gripper");
  }
  ASSERT_GE(held.size(), 3u);
  EXPECT_FALSE(held[0]) << "nothing is predicted for the first frame";
  EXPECT_TRUE(held[1]);
  EXPECT_EQ((*tracker)->waiting_controls(), 0u);
}

}  // namespace
}  // namespace prescene::service::waiting_controls_test
