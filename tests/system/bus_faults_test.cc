// SPDX-License-Identifier: Apache-2.0
// The service among peers that misbehave: clocks that jump, publishers that come and go, a second service, a reader
// that has stopped; and what a supervisor does when it ends. docs/reference/reliability.md has the figures.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <fstream>

#include "prescene/core/text.h"
#include "prescene/interfaces/ros_messages/conversions.h"
#include "prescene/service/tracking/topics.h"
#include "service_on_bus.h"
#include "tests/service/listening_manager.h"

namespace prescene::tests::bus_faults_test {
namespace {

using std::chrono::steady_clock;

constexpr core::TimeNs kHour = 3'600'000'000'000;

double seconds_since(steady_clock::time_point begin) {
  return std::chrono::duration<double>(steady_clock::now() - begin).count();
}

class BusFaults : public ServiceOnBus {
 protected:
  bool says_others(const std::string& count) {
    return drive([&] { return robot_->diagnostics()["other services in the domain"] == count; });
  }
};

TEST_F(BusFaults, AClockThatJumpsByAnHourCostsAFewFrames) {
  const std::string file = path("clock.mcap");
  const auto service = serve({"--record", file});
  ASSERT_TRUE(tracks(*service)) << log();
  std::vector<double> frames, seconds;
  const int jumps = is_full_run() ? 20 : 2;
  for (int i = 0; i < jumps; ++i) {
    shift_ns_ = i % 2 == 0 ? kHour : (i % 4 == 1 ? -kHour : 0);
    const std::uint64_t before = frames_sent_;
    const auto begin = steady_clock::now();
    ASSERT_TRUE(tracks(*service)) << "after the jump to " << core::seconds_of(shift_ns_) << " s: " << log();
    frames.push_back(static_cast<double>(frames_sent_ - before));
    seconds.push_back(seconds_since(begin));
    drive_for(0.3);
  }
  EXPECT_EQ(service->stop(SIGINT), 0) << log();
  EXPECT_GT(replay(file), 0);
  std::printf("compared: clock jumps of an hour: frames until a belief of the new time: %s; s: %s\n",
              spread_text(frames).c_str(), spread_text(seconds).c_str());
}

TEST_F(BusFaults, TheEndOfATerminalClosesTheRecording) {
  const std::string file = path("terminal.mcap");
  // The program leaves a signal ignored that whoever started it ignores, as nohup does; that may be how the tests run.
  const auto before = std::signal(SIGHUP, SIG_DFL);
  const auto service = serve({"--record", file});
  std::signal(SIGHUP, before);
  ASSERT_TRUE(tracks(*service)) << log();
  service->signal(SIGHUP);  // of the shell that ends, and then of the kernel
  EXPECT_EQ(service->stop(SIGHUP), 0) << log();
  EXPECT_EQ(read_back(file).loss, "");
}

TEST_F(BusFaults, TheServiceManagerHearsHowTheServiceIs) {
  const ListeningManager manager(path("notify"));
  const auto service = serve({}, "", {"NOTIFY_SOCKET=" + path("notify"), "WATCHDOG_USEC=600000"});
  std::vector<std::string> heard;
  const auto has = [&](const std::string& text) {
    for (std::string& message : manager.heard()) heard.push_back(std::move(message));
    return std::any_of(heard.begin(), heard.end(),
                       [&](const std::string& message) { return message.starts_with(text); });
  };
  ASSERT_TRUE(drive([&] { return has("STATUS=tracking"); })) << log();
  EXPECT_EQ(heard.front(), "READY=1");
  EXPECT_TRUE(drive([&] {
    static_cast<void>(has(""));
    return std::count(heard.begin(), heard.end(), "WATCHDOG=1") >= 3;
  }));
  EXPECT_EQ(service->stop(SIGINT), 0) << log();
  EXPECT_TRUE(has("STOPPING=1"));
  EXPECT_EQ(std::count(heard.begin(), heard.end(), "READY=1"), 1);
}

TEST_F(BusFaults, PublishersThatComeAndGoLeaveNothingBehind) {
  const auto service = serve();
  ASSERT_TRUE(tracks(*service)) << log();
  const int visitors = is_full_run() ? 200 : 6;
  const service::InputTopics topics;
  std::int64_t kilobytes_before = 0;
  int descriptors_before = 0;
  std::size_t beliefs = 0;
  for (int i = 0; i < visitors; ++i) {
    {
      interfaces::DdsOptions options;
      options.domain = domain_;
      options.node_name = "visitor";
      const auto node = interfaces::DdsNode::create(options, {});
      ASSERT_TRUE(node.ok()) << node.status().message();
      const auto depth = (*node)->advertise(topics.depth, "sensor_msgs/msg/Image", interfaces::TopicQos::kImages);
      const auto tf = (*node)->advertise(topics.tf, "tf2_msgs/msg/TFMessage", interfaces::TopicQos::kTf);
      ASSERT_TRUE(depth.ok() && tf.ok());
      interfaces::RosImage cut = robot_->depth();
      cut.data.resize(cut.data.size() / 2);
      EXPECT_TRUE((*node)->publish(*depth, cut).ok());
      EXPECT_TRUE((*node)->publish(*tf, interfaces::RosTfMessage{}).ok());
      drive_for(0.05);
      beliefs += new_beliefs().size();
      // However long a busy machine takes for a frame, it comes while a visitor is there.
      if (i + 1 == visitors) {
        EXPECT_TRUE(tracks(*service)) << log();
      }
    }
    if (i != visitors / 4) continue;  // what is made once is there by now
    kilobytes_before = process_kilobytes(service->pid(), "VmRSS");
    descriptors_before = process_descriptors(service->pid());
  }
  EXPECT_TRUE(tracks(*service)) << log();
  const auto kilobytes = process_kilobytes(service->pid(), "VmRSS");
  EXPECT_EQ(process_descriptors(service->pid()), descriptors_before);
  std::printf(
      "compared: %d publishers came and went, each for 0.05 s: %zu beliefs meanwhile; memory after a quarter "
      "of them %ld kB, in the end %ld kB; %d descriptors\n",
      visitors, beliefs, static_cast<long>(kilobytes_before), static_cast<long>(kilobytes), descriptors_before);
  EXPECT_EQ(service->stop(SIGINT), 0) << log();
}

TEST_F(BusFaults, ASecondServiceInTheDomainIsToldByBoth) {
  const auto first = serve();
  ASSERT_TRUE(tracks(*first)) << log();
  EXPECT_TRUE(says_others("0")) << robot_->diagnosis();
  const std::string first_log = path("log1");
  const auto second = serve();
  ASSERT_TRUE(says_others("1")) << log();
  const auto told = [&] {
    return read_file(first_log).find("another service publishes") != std::string::npos &&
           log().find("another service publishes") != std::string::npos;
  };
  EXPECT_TRUE(drive(told)) << read_file(first_log) << log();
  EXPECT_EQ(second->stop(SIGINT), 0);
  EXPECT_TRUE(says_others("0")) << robot_->diagnosis();
  EXPECT_EQ(first->stop(SIGINT), 0);
  std::printf(
      "compared: a second service: both logs and /diagnostics say so, and /diagnostics no more after its end\n");
}

TEST_F(BusFaults, AStoppedReaderHoldsNobodyUp) {
  const auto service = serve();
  ASSERT_TRUE(tracks(*service)) << log();
  BackgroundProgram reader(build_dir() / "tests" / "bus_listener", {std::to_string(domain_)}, {}, "/dev/null");
  const double seconds = is_full_run() ? 60.0 : 2.0;
  const auto beliefs_in = [&] {
    new_beliefs();
    const std::uint64_t before = frames_sent_;
    drive_for(seconds);
    return static_cast<double>(new_beliefs().size()) / static_cast<double>(frames_sent_ - before);
  };
  const double share_before = beliefs_in();
  const auto kilobytes_before = process_kilobytes(service->pid(), "VmRSS");
  reader.signal(SIGSTOP);
  const double share_stopped = beliefs_in();
  const auto kilobytes = process_kilobytes(service->pid(), "VmRSS");
  EXPECT_TRUE(tracks(*service)) << log();
  const std::string unsent = robot_->diagnostics()["not sent"];
  reader.stop(SIGKILL);
  EXPECT_TRUE(tracks(*service)) << log();
  EXPECT_EQ(service->stop(SIGINT), 0) << log();
  std::printf(
      "compared: a reader that is stopped for %.0f s: beliefs for each frame %.3f before, %.3f meanwhile; "
      "memory %ld kB before, %ld kB after; not sent: %s\n",
      seconds, share_before, share_stopped, static_cast<long>(kilobytes_before), static_cast<long>(kilobytes),
      unsent.c_str());
}

/// A value of packaging/prescene.service.
std::string unit_value(const std::string& key) {
  std::ifstream unit(source_dir() / "packaging" / "prescene.service");
  EXPECT_TRUE(unit.good());
  for (std::string line; std::getline(unit, line);)
    if (line.starts_with(key + "=")) return line.substr(key.size() + 1);
  return "";
}

TEST_F(BusFaults, StartedAgainByASupervisorItTracksAgain) {
  const double pause = std::atof(unit_value("RestartSec").c_str());
  EXPECT_EQ(unit_value("Restart"), "always") << "systemd takes an end by some signals for a clean one";
  EXPECT_EQ(unit_value("RestartPreventExitStatus"), "2");
  EXPECT_EQ(unit_value("Type"), "notify");
  EXPECT_GT(std::atof(unit_value("WatchdogSec").c_str()), 10.0) << "a first frame of many objects takes seconds";
  EXPECT_EQ(unit_value("StartLimitIntervalSec"), "0") << "systemd would give up for good";
  EXPECT_GT(pause, 0.0);
  std::vector<double> seconds;
  const int times = is_full_run() ? 20 : 2;
  auto service = serve();
  ASSERT_TRUE(tracks(*service)) << log();
  for (int i = 0; i < times; ++i) {
    drive_for(0.1 * i / times);
    EXPECT_EQ(service->stop(SIGKILL), 128 + SIGKILL);
    const auto begin = steady_clock::now();
    drive_for(pause);  // what systemd waits
    service = serve();
    ASSERT_TRUE(tracks(*service)) << log();
    seconds.push_back(seconds_since(begin));
  }
  EXPECT_EQ(service->stop(SIGINT), 0) << log();
  std::printf("compared: killed and started again after %.1f s: s from the end to the next belief: %s\n", pause,
              spread_text(seconds).c_str());
}

}  // namespace
}  // namespace prescene::tests::bus_faults_test
