// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/live_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <functional>
#include <future>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>
#include <vector>

#include "prescene/interfaces/ros_messages/cdr.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/belief_summary.h"
#include "prescene/service/live/bus_replay.h"
#include "tests/interfaces/dds/service_client.h"
#include "tests/service/live_service_fixture.h"
#include "tests/support/paths.h"

namespace prescene::service {
namespace {

using ::testing::HasSubstr;

/// No file of this process grows beyond `bytes` while it lives, as on a disk that is full.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    EXPECT_EQ(getrlimit(RLIMIT_FSIZE, &before_), 0);
    rlimit low = before_;
    low.rlim_cur = bytes;
    EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &low), 0);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, SIG_DFL);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
};

TEST_F(LiveServiceTest, TracksPublishesAndAnswers) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  const auto summary = belief_summary_from_json(robot_.beliefs().back());
  ASSERT_TRUE(summary.ok()) << summary.status().message();
  ASSERT_EQ(summary->objects.size(), 1u);
  EXPECT_LT((summary->objects[0].X_WO.translation - geometry::Vector3d(0.0, 0.0, 0.05)).norm(), 0.03);
  // The first diagnostics may be of before the first frame.
  ASSERT_TRUE(robot_.send_until([&] { return robot_.diagnosis().find("tracking") != std::string::npos; },
                                kNoon + 1000 * kSecond))
      << robot_.diagnosis();
  EXPECT_EQ(robot_.diagnostics()["refused messages"], "0");
  EXPECT_EQ(robot_.diagnostics()["recording"], "off");
  ASSERT_TRUE(robot_.send_until(
      [&] {
        robot_.ask(R"({"id": "7", "where": {}})");
        return !robot_.answers().empty();
      },
      kNoon + 2000 * kSecond));
  EXPECT_THAT(robot_.answers().front(), HasSubstr("\"7\""));
  EXPECT_TRUE(stop().ok());
}

TEST_F(LiveServiceTest, WhatIsKnownSoFarComesOverTheBusBeforeTheAnswer) {
  adjust_ = [](LiveSettings& settings) { settings.worker.most_seconds = 600.0; };  // for a busy machine
  start();
  ASSERT_TRUE(tracks_from(kNoon, 6));
  std::vector<nlohmann::ordered_json> told;  // until the answer
  ASSERT_TRUE(robot_.send_until(
      [&] {
        robot_.ask(
            R"({"id": "s", "stream": true, "stability": {"object": "box", "effort": {"exact_instances": 200}}})");
        told.clear();
        for (const std::string& answer : robot_.answers()) {
          told.push_back(nlohmann::ordered_json::parse(answer));
          if (told.back().value("final", false)) return true;
        }
        return false;
      },
      kNoon + 1000 * kSecond));
  ASSERT_GE(told.size(), 2U);
  for (const auto& answer : told) {
    EXPECT_EQ(answer.at("id"), "s");
    ASSERT_TRUE(answer.contains("stability")) << answer;
  }
  EXPECT_EQ(told.front().at("final"), false);
  EXPECT_LT(told.front().at("stability").at("instances"), 200);
  EXPECT_EQ(told.back().at("stability").at("instances"), 200);
  EXPECT_TRUE(stop().ok());
}

TEST_F(LiveServiceTest, ServicesAnswerAndRestart) {
  adjust_ = [](LiveSettings& settings) {  // for a busy machine
    settings.worker.default_seconds = settings.worker.most_seconds = 600.0;
  };
  start();
  ASSERT_TRUE(tracks_from(kNoon, 6));
  tests::ServiceClient where(tests::own_domain(), "/prescene/where");
  ASSERT_TRUE(where.wait_for_service());
  const auto known = where.call();
  ASSERT_TRUE(known.has_value());
  EXPECT_TRUE(known->success) << known->text;
  const auto json = nlohmann::ordered_json::parse(known->text);
  EXPECT_FALSE(json.contains("id"));
  EXPECT_EQ(json.at("where").at("items").at(0).at("object"), "box") << known->text;
  tests::ServiceClient relations(tests::own_domain(), "/prescene/relations");
  ASSERT_TRUE(relations.wait_for_service());
  const auto related = relations.call();
  ASSERT_TRUE(related.has_value());
  EXPECT_TRUE(related->success) << related->text;
  tests::ServiceClient ask(tests::own_domain(), "/prescene/ask", true);
  ASSERT_TRUE(ask.wait_for_service());
  const auto asked = ask.call(R"({"where": {"object": "box"}})");
  ASSERT_TRUE(asked.has_value());
  EXPECT_TRUE(asked->success) << asked->text;
  const auto streamed =
      ask.call(R"({"stream": true, "stability": {"object": "box", "effort": {"exact_instances": 8}}})");
  ASSERT_TRUE(streamed.has_value());
  EXPECT_THAT(streamed->text, HasSubstr("\"final\":true")) << "a service replies with the answer only";
  for (const char* nonsense : {"", "no JSON", "[]", R"({"where": 7})", R"({"stability": {"object": "nobody"}})"}) {
    const auto refused = ask.call(nonsense);
    ASSERT_TRUE(refused.has_value()) << nonsense;
    EXPECT_FALSE(refused->success) << nonsense;
    EXPECT_THAT(refused->text, HasSubstr("\"error\"")) << nonsense;
  }
  tests::ServiceClient save(tests::own_domain(), "/prescene/save_learned");
  ASSERT_TRUE(save.wait_for_service());
  const auto saved = save.call();
  ASSERT_TRUE(saved.has_value());
  EXPECT_FALSE(saved->success);
  EXPECT_THAT(saved->text, HasSubstr("--learned FILE"));
  tests::ServiceClient restart(tests::own_domain(), "/prescene/restart");
  ASSERT_TRUE(restart.wait_for_service());
  const std::size_t before = robot_.beliefs().size();
  const auto restarted = restart.call();
  ASSERT_TRUE(restarted.has_value());
  EXPECT_TRUE(restarted->success);
  EXPECT_TRUE(robot_.send_until(
      [&] {
        const std::vector<std::string> beliefs = robot_.beliefs();
        return std::any_of(beliefs.begin() + static_cast<std::ptrdiff_t>(before), beliefs.end(), [](const auto& text) {
          const auto summary = belief_summary_from_json(text);
          return summary && summary->step == 1;
        });
      },
      kNoon + 100 * kSecond));
}

TEST_F(LiveServiceTest, AServiceSavesWhatWasLearned) {
  const tests::ScratchDir folder;
  const std::filesystem::path file = folder.path() / "learned.yaml";
  learned_file_ = file.string();
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  tests::ServiceClient save(tests::own_domain(), "/prescene/save_learned");
  ASSERT_TRUE(save.wait_for_service());
  const auto saved = save.call();
  ASSERT_TRUE(saved.has_value());
  EXPECT_TRUE(saved->success) << saved->text;
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_TRUE(stop().ok());
}

TEST_F(LiveServiceTest, GoesOnTrackingWhenTheSendersClockIsSet) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  EXPECT_TRUE(tracks_from(kNoon - 3600 * kSecond)) << robot_.diagnosis();
  EXPECT_TRUE(tracks_from(kNoon + 3600 * kSecond)) << robot_.diagnosis();
  EXPECT_TRUE(stop().ok());
}

TEST_F(LiveServiceTest, SaysHowSimulatedTimeGoes) {
  start(nullptr, kClockTopic);
  // Complete frames are used, but for all that the service knows no time passes.
  ASSERT_TRUE(tracks_from(kNoon));
  const auto says = [&](const std::string& text) {
    return robot_.send_until([&] { return robot_.diagnosis().find(text) != std::string::npos; }, kNoon + kSecond);
  };
  EXPECT_TRUE(says("no simulated time has come on /clock")) << robot_.diagnosis();
  robot_.send_clock(5 * kSecond);
  EXPECT_TRUE(robot_.send_until(
      [&] {
        robot_.send_clock(7 * kSecond);
        return robot_.diagnostics()["simulated time, s"] == "7.000";
      },
      kNoon + kSecond));
  EXPECT_TRUE(says("simulated time stands still: nothing new on /clock for ")) << robot_.diagnosis();
}

TEST_F(LiveServiceTest, ARecordingThatFailsStandsInDiagnosticsAndInTheStatus) {
  const tests::ScratchDir folder;
  auto recording = RollingRecording::create(folder.path() / "run.mcap", {});
  ASSERT_TRUE(recording.ok()) << recording.status().message();
  const FullDisk full(20'000);
  start(*std::move(recording));
  ASSERT_TRUE(tracks_from(kNoon));
  ASSERT_TRUE(robot_.send_until([&] { return robot_.diagnostics()["recording"].starts_with("failed: "); },
                                kNoon + 1000 * kSecond));
  EXPECT_THAT(robot_.diagnosis(), HasSubstr("run.mcap"));
  EXPECT_TRUE(tracks_from(kNoon + 2000 * kSecond)) << "tracking goes on";
  const core::Status status = stop();
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(status.message(), HasSubstr("run.mcap"));
}

TEST_F(LiveServiceTest, RecordsAStepBeforeAnythingThatIsMadeOfIt) {
  const tests::ScratchDir folder;
  auto recording = RollingRecording::create(folder.path() / "run.mcap", {});
  ASSERT_TRUE(recording.ok()) << recording.status().message();
  start(*std::move(recording));
  ASSERT_TRUE(tracks_from(kNoon));
  ASSERT_TRUE(stop().ok());
  const auto reader = RecordingReader::open(folder.path() / "run.mcap");
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  std::vector<std::string> order;
  for (;;) {
    const auto entry = (*reader)->next();
    ASSERT_TRUE(entry.ok()) << entry.status().message();
    if (!*entry) break;
    if ((*entry)->is_json) order.push_back((*entry)->message.topic);
  }
  // Changes are told between a step and its belief, where there are any.
  std::erase(order, std::string(kEventsTopic));
  ASSERT_GE(order.size(), 2u);
  for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i % 2 == 0 ? kStepTopic : kBeliefTopic) << i;
}

TEST_F(LiveServiceTest, TellsWhichControlsWaitAndWhyOneIsRefused) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  const auto controlled = [&](const std::string& json, const std::function<bool()>& done) {
    return robot_.send_until(
        [&] {
          robot_.control(json);
          return done();
        },
        kNoon + kSecond);
  };
  const std::string action = R"("actions": [{"time": 3000, "release": {"object": "box"}}]})";
  EXPECT_TRUE(controlled("{" + action, [&] { return std::stoi("0" + robot_.diagnostics()["controls waiting"]) > 0; }));
  EXPECT_EQ(robot_.diagnostics()["controls dropped"], "0");
  EXPECT_TRUE(controlled(R"({"stamp_ns": 2000000000000000000, )" + action, [&] {
    return robot_.diagnostics()["last refusal"].find("after the newest frame's stamp") != std::string::npos;
  }));
  EXPECT_TRUE(stop().ok());
}

TEST_F(LiveServiceTest, TellsOfControlsThatChangeNothing) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  EXPECT_EQ(robot_.diagnostics()["controls without effect"], "0");
  EXPECT_TRUE(robot_.send_until(
      [&] {
        robot_.control(R"({"actions": [{"time": 0, "release": {"object": "box"}}]})");
        return robot_.diagnostics()["last control without effect"].find("nothing holds it") != std::string::npos;
      },
      kNoon + kSecond));
  EXPECT_TRUE(stop().ok());
  EXPECT_THAT(log_, testing::Contains(HasSubstr("/prescene/control: the action 'release' of 'box' changes nothing")));
}

TEST_F(LiveServiceTest, TellsOfAnotherServiceInItsDomainWhileItIsThere) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  const auto others = [&](const std::string& count) {
    return robot_.send_until([&] { return robot_.diagnostics()["other services in the domain"] == count; },
                             kNoon + kSecond);
  };
  EXPECT_TRUE(others("0"));
  interfaces::DdsOptions options;
  options.domain = tests::own_domain();
  auto other = interfaces::DdsNode::create(options, {});
  ASSERT_TRUE(other.ok()) << other.status().message();
  ASSERT_TRUE((*other)->advertise(kBeliefTopic, "std_msgs/msg/String", interfaces::TopicQos::kState).ok());
  EXPECT_TRUE(others("1"));
  EXPECT_THAT(robot_.diagnosis(), HasSubstr("another service publishes in this DDS domain"));
  other->reset();
  EXPECT_TRUE(others("0"));
  EXPECT_TRUE(stop().ok());
  EXPECT_THAT(log_, testing::Contains(HasSubstr("another service publishes in this DDS domain")));
}

TEST_F(LiveServiceTest, AReplayThatFailsEndsWhileTheServiceSpeaks) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  BusReplayOptions options;
  options.dds.domain = tests::own_domain();
  const tests::ScratchDir folder;
  EXPECT_TRUE(robot_.send_until(
      [&, tries = 0]() mutable {
        const auto result = replay_over_bus(folder.path() / "none.mcap", options, {}, {}, {});
        EXPECT_EQ(result.status().code(), core::StatusCode::kNotFound);
        return ++tries == 20;
      },
      kNoon + kSecond));
  EXPECT_TRUE(stop().ok());
}

TEST_F(LiveServiceTest, AReplayStopsInAPauseAndWhileItWaitsForAService) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  const core::Status recorded = tests::record_scene(tests::kBoxScene, {}, 10.0, path);
  ASSERT_TRUE(recorded.ok()) << recorded.message();
  BusReplayOptions options;
  options.dds.domain = tests::own_domain();
  options.wait_for_service = 1e9;
  core::Cancellation stop_waiting;
  stop_waiting.request();
  EXPECT_EQ(replay_over_bus(path, options, stop_waiting, {}, {}).status().code(), core::StatusCode::kCancelled);

  options.wait_for_service = 0.0;
  options.speed = kReplaySpeeds.low;  // minutes between one frame and the next
  std::promise<void> began;
  core::Cancellation stop_playing;
  std::thread stopper([&] {
    began.get_future().wait();
    stop_playing.request();
  });
  int entries = 0;
  const auto result = replay_over_bus(path, options, stop_playing, {}, {}, [&](const RecordedEntry&) {
    if (++entries == 1) began.set_value();
  });
  stopper.join();
  ASSERT_TRUE(result.ok()) << result.status().message();
  EXPECT_LT(entries, 10);
}

TEST_F(LiveServiceTest, ALoopPlaysTheSameStampsAgainUntilItIsStopped) {
  const tests::ScratchDir folder;
  const std::filesystem::path path = folder.path() / "run.mcap";
  const core::Status recorded = tests::record_scene(tests::kBoxScene, {}, 10.0, path);
  ASSERT_TRUE(recorded.ok()) << recorded.message();
  BusReplayOptions options;
  options.dds.domain = tests::own_domain();
  options.wait_for_service = 0.0;
  options.loop = true;

  const core::Cancellation never;
  core::Cancellation enough(never, core::Cancellation::Clock::now() + std::chrono::minutes(1));
  const auto stamp_of = [](const interfaces::ReceivedMessage& message) -> core::TimeNs {
    const auto image = interfaces::decode_cdr<interfaces::RosImage>(message.cdr);
    if (!image) return -1;
    const auto stamp = interfaces::to_stamp_ns(image->header.stamp);
    return stamp ? *stamp : -1;
  };
  std::vector<core::TimeNs> heard;  // of the node's thread, until it is stopped
  int returns = 0;
  const auto node = interfaces::DdsNode::create(options.dds, {});
  ASSERT_TRUE(node.ok()) << node.status().message();
  ASSERT_TRUE((*node)
                  ->subscribe(InputTopics().depth, "sensor_msgs/msg/Image", interfaces::TopicQos::kReliable,
                              [&](interfaces::ReceivedMessage&& message) {
                                heard.push_back(stamp_of(message));
                                if (heard.size() > 1 && heard.back() < heard[heard.size() - 2]) ++returns;
                                if (returns == 3) enough.request();
                              })
                  .ok());
  std::set<core::TimeNs> stamps;
  std::uint64_t entries = 0;
  const auto result = replay_over_bus(path, options, enough, {}, {}, [&](const RecordedEntry& entry) {
    ++entries;
    if (entry.message.topic == InputTopics().depth) stamps.insert(stamp_of(entry.message));
  });
  (*node)->stop_receiving();
  ASSERT_TRUE(result.ok()) << result.status().message();
  EXPECT_GE(returns, 3);
  EXPECT_GE(result->rounds, 4u);
  EXPECT_GT(result->messages, 3 * stamps.size());
  EXPECT_GE(stamps.size(), 3u) << "of " << entries;
  for (const core::TimeNs stamp_ns : heard) EXPECT_TRUE(stamps.contains(stamp_ns)) << stamp_ns;

  options.questions = {{0.0, R"({"where": {}})"}};
  EXPECT_EQ(replay_over_bus(path, options, enough, {}, {}).status().code(), core::StatusCode::kInvalidInput);
}

TEST_F(LiveServiceTest, RefusesWhatMakesNoSenseAndGoesOn) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  interfaces::RosImage nonsense = robot_.depth();
  nonsense.header.stamp = interfaces::RosTime{5, 4'000'000'000U};
  EXPECT_TRUE(refuses(nonsense));
  nonsense = robot_.depth();
  nonsense.step = 1;
  EXPECT_TRUE(refuses(nonsense));
  nonsense = robot_.depth();
  nonsense.header.frame_id = "lens\xff\xfe";
  EXPECT_TRUE(refuses(nonsense));
  EXPECT_TRUE(tracks_from(kNoon + 1000 * kSecond));
  EXPECT_EQ(robot_.diagnostics()["failures"], "0");
  EXPECT_TRUE(stop().ok());
}

TEST_F(LiveServiceTest, AStormOfTransformsCostsNeitherFramesNorMemoryAndStopsAtOnce) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  // A chain of 4,090 frames: more than are kept, and the longest way to a root.
  interfaces::RosTfMessage storm;
  for (int i = 0; i < 4090; ++i) {
    interfaces::RosTransformStamped link;
    link.header.stamp = interfaces::to_ros_time(kNoon);
    link.header.frame_id = "link" + std::to_string(i);
    link.child_frame_id = "link" + std::to_string(i + 1);
    link.transform.rotation.w = 1.0;
    storm.transforms.push_back(link);
  }
  for (int i = 0; i < 200; ++i) robot_.send_tf(storm);
  EXPECT_TRUE(tracks_from(kNoon + kSecond, 10)) << robot_.diagnosis();
  for (int i = 0; i < 200; ++i) robot_.send_tf(storm);
  EXPECT_TRUE(stop().ok());
}

TEST_F(LiveServiceTest, LogsARepeatedFaultOnceInAWhile) {
  start();
  ASSERT_TRUE(tracks_from(kNoon));
  interfaces::RosImage nonsense = robot_.depth();
  for (int i = 0; i < 500; ++i) {
    nonsense.header.stamp = interfaces::to_ros_time(kNoon + 2000 * kSecond);
    nonsense.encoding = "unknown" + std::to_string(i);
    robot_.send_depth(nonsense);
    robot_.wait(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(robot_.send_until([&] { return robot_.diagnostics()["lines not logged"] != "0"; }, kNoon + kSecond));
  EXPECT_TRUE(stop().ok());
  EXPECT_LT(log_.size(), 200u) << "twenty at once and one in two seconds, however long this takes";
}

}  // namespace
}  // namespace prescene::service
