// SPDX-License-Identifier: Apache-2.0
// security_peer DOMAIN FOLDER NAME talk|hear|both TOPIC: says its name on a topic of texts again and again, and prints
// "heard NAME" for each that it hears there from somebody else, until it is killed. FOLDER: keys, or - for none. Where
// it may not, it prints "refused: why" and ends.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "prescene/interfaces/dds/dds_node.h"
#include "prescene/interfaces/ros_messages/cdr.h"

int main(int argc, char** argv) {
  using namespace prescene;
  if (argc != 6) return 2;
  const std::string folder = argv[2];
  const std::string name = argv[3];
  const std::string does = argv[4];
  interfaces::DdsOptions options;
  options.domain = std::atoi(argv[1]);
  options.node_name = name;
  if (folder != "-") options.security = folder;
  const auto say = [](const std::string& line) {
    std::printf("%s\n", line.c_str());
    std::fflush(stdout);
  };
  const auto refused = [&](const core::Status& why) {
    say("refused: " + why.message());
    return 1;
  };
  const auto node = interfaces::DdsNode::create(options, {});
  if (!node) return refused(node.status());
  if (does != "talk") {
    const auto hears = (*node)->subscribe(
        argv[5], "std_msgs/msg/String", interfaces::TopicQos::kReliable, [&](interfaces::ReceivedMessage&& message) {
          const auto text = interfaces::decode_cdr<interfaces::RosString>(message.cdr);
          if (text && text->data != name) say("heard " + text->data);
        });
    if (!hears.ok()) return refused(hears);
  }
  interfaces::DdsPublisher publisher;
  if (does != "hear") {
    const auto talks = (*node)->advertise(argv[5], "std_msgs/msg/String", interfaces::TopicQos::kReliable);
    if (!talks) return refused(talks.status());
    publisher = *talks;
  }
  say("ready");
  for (;;) {
    if (does != "hear") static_cast<void>((*node)->publish(publisher, interfaces::RosString{name}));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}
