// SPDX-License-Identifier: Apache-2.0
// What a node is told and tells: interfaces, buffers, its log, and options and names that are refused.
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <dds/ddsrt/log.h>
#include "dds_options.h"
#include "prescene/interfaces/dds/dds_node.h"
#include "tests/support/paths.h"

namespace prescene::interfaces {
namespace {

using dds_tests::options;

TEST(DdsNode, SaysWhichInterfaceItUses) {
  DdsOptions asking = options();
  asking.domain = tests::another_domain();  // where no node of this process was before
  asking.find_interfaces = true;
  const auto node = DdsNode::create(asking, {});
  ASSERT_TRUE(node.ok()) << node.status().message();
  EXPECT_NE((*node)->interfaces().find("(index "), std::string::npos) << (*node)->interfaces();
  EXPECT_EQ((*node)->interfaces().find('\n'), std::string::npos);
}

TEST(DdsNode, UsesTheInterfaceThatItIsToldToUse) {
  DdsOptions here = options();
  here.domain = tests::another_domain();  // where no node of this process was before
  here.find_interfaces = true;
  here.interfaces = {"lo"};
  const auto node = DdsNode::create(here, {});
  ASSERT_TRUE(node.ok()) << node.status().message();
  EXPECT_EQ((*node)->interfaces().find("lo (index "), 0u) << (*node)->interfaces();
}

// Nodes that are kept to the loopback interface in the usual way have no multicast there.
TEST(DdsNode, OnTheLoopbackInterfaceHearsThoseThatAreKeptToIt) {
  DdsOptions ours = options();
  ours.domain = tests::another_domain();
  ours.interfaces = {"lo"};
  const auto reader = DdsNode::create(ours, {});
  ASSERT_TRUE(reader.ok()) << reader.status().message();
  ASSERT_TRUE((*reader)->subscribe("/kept/text", "std_msgs/msg/String", TopicQos::kReliable, {}).ok());
  const std::string peer = (tests::build_dir() / "tests" / "security_peer").string();
  const std::string domain = std::to_string(ours.domain);
  std::array<const char*, 7> words = {peer.c_str(), domain.c_str(), "-", "kept", "talk", "/kept/text", nullptr};
  std::array<const char*, 2> environment = {
      "CYCLONEDDS_URI=<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>", nullptr};
  pid_t child = -1;
  ASSERT_EQ(posix_spawn(&child, peer.c_str(), nullptr, nullptr, const_cast<char**>(words.data()),
                        const_cast<char**>(environment.data())),
            0);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while ((*reader)->matched_writers("/kept/text") == 0 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::yield();
  EXPECT_EQ((*reader)->matched_writers("/kept/text"), 1);
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

TEST(DdsNode, InterfacesOfTwoPlacesAreRefused) {
  DdsOptions twice = options();
  twice.interfaces = {"lo"};
  setenv("CYCLONEDDS_URI", "<General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces></General>", 1);
  const core::Status refused = DdsNode::create(twice, {}).status();
  unsetenv("CYCLONEDDS_URI");
  EXPECT_EQ(refused.code(), core::StatusCode::kInvalidInput);
  EXPECT_NE(refused.message().find("CYCLONEDDS_URI"), std::string::npos) << refused.message();
}

TEST(DdsNode, RefusesNamesOfInterfacesAndPeersThatAreNone) {
  for (const std::string& name :
       {std::string(), std::string("eth0\"/><x"), std::string("two words"), std::string(300, 'a')}) {
    DdsOptions wrong = options();
    wrong.interfaces = {"lo", name};
    EXPECT_EQ(DdsNode::create(wrong, {}).status().code(), core::StatusCode::kInvalidInput) << name;
    wrong.interfaces.clear();
    wrong.peers = {name};
    EXPECT_EQ(DdsNode::create(wrong, {}).status().code(), core::StatusCode::kInvalidInput) << name;
  }
}

TEST(DdsNode, SaysWhenTheSystemGrantsASmallerReceiveBuffer) {
  std::vector<std::string> lines;
  const auto log = [&](core::LogLevel, const std::string& line) { lines.push_back(line); };
  DdsOptions modest = options();
  modest.receive_buffer_bytes = 8192;
  EXPECT_TRUE(DdsNode::create(modest, log).ok());
  EXPECT_TRUE(lines.empty());
  DdsOptions greedy = options();
  greedy.receive_buffer_bytes = std::numeric_limits<int>::max();  // no system grants that
  EXPECT_TRUE(DdsNode::create(greedy, log).ok());
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_NE(lines[0].find("sysctl -w net.core.rmem_max=2147483647"), std::string::npos) << lines[0];
}

TEST(DdsNode, WhatCycloneSaysIsInTheLogOfItsNode) {
  std::mutex mutex;
  std::vector<std::pair<core::LogLevel, std::string>> lines;
  const auto log = [&](core::LogLevel level, const std::string& line) {
    const std::lock_guard lock(mutex);
    lines.emplace_back(level, line);
  };
  using Levels = std::vector<core::LogLevel>;
  /// Of the lines of the log that say `line`, once Cyclone said `text`.
  const auto levels_of = [&](std::uint32_t level, const char* text, const std::string& line) {
    dds_log(level, __FILE__, __LINE__, "test", "%s\n", text);
    const std::lock_guard lock(mutex);
    Levels levels;
    for (const auto& [of_line, logged] : lines)
      if (logged == line) levels.push_back(of_line);
    return levels;
  };
  constexpr core::LogLevel kWarning = core::LogLevel::kWarning;
  {
    const auto node = DdsNode::create(options(), log);
    ASSERT_TRUE(node.ok()) << node.status().message();
    EXPECT_EQ(levels_of(DDS_LC_WARNING, "a peer sends \x1b[31m\xff", "Cyclone DDS: a peer sends \\x1b[31m\\xff"),
              Levels{kWarning});
    const auto without_log = DdsNode::create(options(), {});
    EXPECT_EQ(levels_of(DDS_LC_ERROR, "it ends", "Cyclone DDS: it ends"), Levels{core::LogLevel::kError});
    const auto later = DdsNode::create(options(), log);
    EXPECT_EQ(levels_of(DDS_LC_WARNING, "once", "Cyclone DDS: once"), Levels{kWarning}) << "the oldest gets it";
  }
  EXPECT_EQ(levels_of(DDS_LC_WARNING, "nobody listens", "Cyclone DDS: nobody listens"), Levels());
  const auto again = DdsNode::create(options(), log);
  EXPECT_EQ(levels_of(DDS_LC_WARNING, "again", "Cyclone DDS: again"), Levels{kWarning});
}

TEST(DdsNode, WhyCycloneEndsTheProgramIsPrintedWhateverTheLogDoes) {
  const auto end_with_a_node = [] {
    const auto node = DdsNode::create(options(), [](core::LogLevel, const std::string&) {});
    dds_log(DDS_LC_FATAL, __FILE__, __LINE__, "test", "%s\n", "no way on");
  };
  EXPECT_DEATH(end_with_a_node(), "Cyclone DDS: no way on");
}

TEST(DdsNode, AnnouncesItselfInEitherForm) {
  for (const RosDistro distro : {RosDistro::kHumble, RosDistro::kJazzy}) {
    DdsOptions announced = options();
    announced.ros_distro = distro;
    const auto node = DdsNode::create(announced, {});
    ASSERT_TRUE(node.ok()) << node.status().message();
    EXPECT_TRUE((*node)->advertise("/prescene/answer", "std_msgs/msg/String", TopicQos::kReliable).ok());
  }
}

TEST(DdsNode, BadNamesTypesAndOptionsAreRefusedWithTheRemedy) {
  DdsOptions wrong = options();
  wrong.domain = 300;
  EXPECT_EQ(DdsNode::create(wrong, {}).status().code(), core::StatusCode::kInvalidInput);
  auto node = DdsNode::create(options(), {});
  ASSERT_TRUE(node.ok());
  for (const char* topic : {"", "relative", "/", "/a//b", "/1a", "/a b", "/a/", "/\xc3\xa4"}) {
    EXPECT_EQ((*node)->advertise(topic, "std_msgs/msg/String", TopicQos::kReliable).status().code(),
              core::StatusCode::kInvalidInput)
        << topic;
  }
  EXPECT_EQ((*node)->advertise("/a", "std_msgs/msg/Strin", TopicQos::kReliable).status().code(),
            core::StatusCode::kUnsupported);
  const auto publisher = (*node)->advertise("/a", "std_msgs/msg/String", TopicQos::kReliable);
  ASSERT_TRUE(publisher.ok());
  EXPECT_EQ((*node)->publish(*publisher, RosClock{}).code(), core::StatusCode::kInvalidInput);
  EXPECT_FALSE((*node)->publish_cdr(*publisher, {1, 2, 3}).ok());
}

}  // namespace
}  // namespace prescene::interfaces
