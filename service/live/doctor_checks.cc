// SPDX-License-Identifier: Apache-2.0
#include "doctor_checks.h"

#include <algorithm>
#include <span>

#include "prescene/core/order_statistics.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/service/live/service_health.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using interfaces::quote;

// Below it whole frames are lost in the socket: RGB-D of 1280 x 720 arrived in full with 4 MiB, hardly with 1 MiB.
constexpr int kLeastBuffer = 4 << 20;

void check_domain(const BusSurroundings& around, Checks& checks) {
  const std::string domain = "DDS domain " + std::to_string(around.domain);
  if (around.participants == 0) {
    checks.fail(
        "domain", "nobody else is in " + domain,
        "start the robot's nodes; give the same domain on both sides (--domain, ROS_DOMAIN_ID); across machines, "
        "let multicast through or name the other machine (--peer)");
  } else {
    checks.ok("domain",
              domain + ", " + counted_text(static_cast<std::size_t>(around.participants), "other participant"));
  }
  const std::string name = "network interface";
  for (const auto& [variable, value] : around.ros) {
    if (around.interfaces.starts_with("lo ")) continue;
    checks.warn(name,
                "the environment has " + variable + "=" + value +
                    ", so nodes of ROS that are started in it keep to this machine's loopback interface, while "
                    "Prescene uses " +
                    (around.interfaces.empty() ? "another" : around.interfaces),
                "unset " + variable + ", or give Prescene the same interface: --interface lo");
    return;
  }
  if (around.interfaces.empty()) return;
  if (around.interfaces.starts_with("lo "))
    checks.warn(name, around.interfaces + ": only nodes on this machine are found",
                "if the camera is on another machine, connect the network, or name its interface (--interface)");
  else
    checks.ok(name, around.interfaces);
}

void check_buffer(std::span<const BusEvidence> cameras, const BusSurroundings& around, Checks& checks) {
  const std::string name = "receive buffer";
  std::size_t frame_bytes = 0;
  for (const BusEvidence& evidence : cameras)
    for (const auto& [topic, seen] : evidence.topics())
      if (topic == evidence.settings().topics.depth || topic == evidence.settings().topics.color)
        frame_bytes += seen.largest_bytes;
  const std::string frame = frame_bytes == 0 ? ""
                                             : std::string("; a frame of depth and colour") +
                                                   (cameras.size() > 1 ? " of all cameras" : "") + " has " +
                                                   interfaces::size_text(frame_bytes);
  // Two frames, as the second may arrive while the first is taken out.
  const std::size_t needed = std::max<std::size_t>(kLeastBuffer, 2 * frame_bytes);
  const std::string remedy =
      "sysctl -w net.core.rmem_max=" +
      std::to_string(std::max<std::size_t>(static_cast<std::size_t>(around.asked_buffer), needed));
  if (around.lost_datagrams > 0) {
    checks.warn(name,
                std::to_string(around.lost_datagrams) +
                    " datagrams were lost on this machine while listening, because a receive buffer was full" + frame,
                remedy + "; images of fewer pixels, or compressed ones");
  } else if (around.granted_buffer && static_cast<std::size_t>(*around.granted_buffer) < needed) {
    checks.warn(name,
                "the system grants " + interfaces::size_text(static_cast<std::size_t>(*around.granted_buffer)) +
                    ", but images need " + interfaces::size_text(needed) + frame,
                remedy);
  } else if (around.granted_buffer) {
    checks.ok(name, interfaces::size_text(static_cast<std::size_t>(*around.granted_buffer)) + frame +
                        ", and no datagram was lost");
  }
}

void check_services(const BusSurroundings& around, Checks& checks) {
  if (around.other_services > 0)
    checks.warn("other services", others_text(around.other_services),
                "stop the others, or give each a --domain of its own");
  else
    checks.ok("other services", "none in this domain");
}

void check_joints(const BusEvidence& evidence, Checks& checks) {
  const std::string& topic = evidence.settings().topics.joint_states;
  if (!evidence.joints().has_robot() || topic.empty()) return;
  const TopicEvidence& seen = evidence.topics().at(topic);
  const std::string name = "joint states";
  const std::string came = topic + ": " + rate_text(seen);
  if (seen.refused > 0) {
    checks.warn(name, came + ", of which " + std::to_string(seen.refused) + " were refused: " + seen.last_refusal,
                "correct the sender as the text says");
  } else if (seen.messages == 0) {
    checks.ok(name, "nothing came on " + topic + ", so tf has to give the links' poses");
  } else if (evidence.joints().messages() == 0) {
    checks.warn(name, came + ", but none tells of a joint of " + evidence.settings().assembler.robot->file,
                "name the topic of this robot with --joint-states-topic, or its URDF in the scene file");
  } else if (const std::vector<std::string> missing = evidence.joints().missing(); !missing.empty()) {
    checks.warn(name,
                came + "; " + counted_text(missing.size(), "joint") + " without a position, the first is " +
                    quote(missing.front()),
                "publish them, or give their positions under robot_description.joint_positions in the scene file");
  } else {
    checks.ok(name, came + ", with every joint that moves");
  }
}

/// Of the robot, whichever camera sees it.
void check_robot(const BusEvidence& evidence, Checks& checks) {
  const AssemblerSettings& settings = evidence.settings().assembler;
  const InputTopics& topics = evidence.settings().topics;
  const core::TimeNs stamp_ns = evidence.topics().at(topics.depth).stamp_ns;
  const auto& newest = evidence.newest();
  for (const std::string& topic : {topics.tf, topics.tf_static}) {
    const TopicEvidence& seen = evidence.topics().at(topic);
    if (seen.refused > 0)
      checks.warn("tf",
                  std::to_string(seen.refused) + " of " + std::to_string(seen.messages) + " messages on " + topic +
                      " were refused: " + seen.last_refusal,
                  "correct the sender as the text says");
  }
  check_joints(evidence, checks);
  std::string missing;
  for (const std::string& body : evidence.robot())
    if (!evidence.tf().lookup(settings.world_frame, body, stamp_ns) &&
        (!newest || !newest->observation.robot.contains(body)))
      missing += (missing.empty() ? "" : ", ") + body;
  if (!missing.empty())
    checks.warn("robot",
                (evidence.joints().has_robot() ? "neither tf nor joint states give" : "tf does not give") +
                    (" the pose of: " + missing) + "; they are taken to be where the scene file says",
                evidence.joints().has_robot()
                    ? "publish the joints' positions on " + topics.joint_states + " and the pose of " +
                          evidence.settings().assembler.robot->root +
                          " in tf (or as 'pose' "
                          "under robot_description), or start robot_state_publisher"
                    : "publish their poses under these names, or rename the bodies in the scene file");
  else if (!evidence.robot().empty())
    checks.ok("robot", "tf gives the pose of " + counted_text(evidence.robot().size(), "robot part") + " of the scene");
}

void check_simulated_time(const BusEvidence& evidence, const BusSurroundings& around, Checks& checks) {
  const std::string name = "simulated time";
  const std::string type = "rosgraph_msgs/msg/Clock";
  const std::string& topic = evidence.settings().topics.clock;
  if (topic.empty()) {
    if (writers_of(around, kClockTopic, type) > 0)
      checks.warn(name, std::string("somebody tells it on ") + kClockTopic + ", but real time is used",
                  "give --use-sim-time, here and to serve, if the camera is simulated");
    return;
  }
  if (!evidence.simulated_ns()) {
    const std::string& refusal = evidence.topics().at(topic).last_refusal;
    checks.fail(name, refusal.empty() ? "nothing has come on " + topic : topic + ": " + refusal,
                "start the simulator (or `ros2 bag play --clock`), or leave --use-sim-time out");
    return;
  }
  const TopicEvidence& seen = evidence.topics().at(topic);
  const double passed = core::seconds_of(*evidence.simulated_ns() - evidence.first_simulated_ns());
  const std::string what = topic + ": " + fixed_text(core::seconds_of(*evidence.simulated_ns()), 2) + " s, " +
                           rate_text(seen) + ", " + fixed_text(passed, 2) + " s passed in " +
                           fixed_text(core::seconds_of(seen.last_ns - seen.first_ns), 2) + " s";
  if (passed > 0.0)
    checks.ok(name, what);
  else
    checks.warn(name, what, "let the simulation run: it is paused, or began anew just now");
}

/// Between several cameras: which are used, whether their clocks are one, and whether their frames are.
void check_together(std::span<const BusEvidence> cameras, Checks& checks) {
  std::string used, unused;
  for (const BusEvidence& evidence : cameras) {
    std::string& list = evidence.frames() > 0 ? used : unused;
    list += (list.empty() ? "" : ", ") + evidence.camera_name();
  }
  if (used.empty())
    checks.fail("cameras", "no camera gives frames that can be used: " + unused, "mend what is reported above");
  else if (!unused.empty())
    checks.warn("cameras", "frames of " + used + " can be used, those of " + unused + " can't",
                "mend what is reported above: only the others would be tracked by");
  else
    checks.ok("cameras", "frames of all can be used: " + used);

  const BusEvidence* first = nullptr;
  double earliest = 0.0, latest = 0.0;
  const BusEvidence *oldest = nullptr, *newest = nullptr;
  for (const BusEvidence& evidence : cameras) {
    const auto& ages = evidence.topics().at(evidence.settings().topics.depth).ages;
    if (ages.empty()) continue;
    const double age = core::upper_median(ages);
    if (first == nullptr || age < earliest) earliest = age, newest = &evidence;
    if (first == nullptr || age > latest) latest = age, oldest = &evidence;
    if (first == nullptr) first = &evidence;
  }
  if (first == nullptr || oldest == newest) return;
  const double apart = latest - earliest;
  const std::string what = "stamps of " + oldest->camera_name() + " are " + fixed_text(1e3 * apart, 0) +
                           " ms behind those of " + newest->camera_name() + " (medians, when they came)";
  if (apart > first->settings().assembler.max_wait_s)
    checks.warn("clocks", what + ": frames of " + oldest->camera_name() + " would come too late and not be used",
                "set the clocks of the cameras' computers by one (NTP, PTP), or let frames wait longer for each other "
                "(ros2 param set /prescene max_wait)");
  else
    checks.ok("clocks", what);
}

}  // namespace

std::string counted_text(std::size_t number, const std::string& thing) {
  return std::to_string(number) + " " + thing + (number == 1 ? "" : "s");
}

std::string rate_text(const TopicEvidence& topic) {
  const auto rate = topic.rate();
  return rate ? fixed_text(*rate, 1) + " Hz" : counted_text(topic.messages, "message");
}

int writers_of(const BusSurroundings& around, const std::string& topic, const std::string& type) {
  int writers = 0;
  for (const interfaces::DomainTopic& there : around.topics)
    if (there.name == topic && there.type == type) writers += there.writers;
  return writers;
}

std::vector<DoctorCheck> checks_of(std::span<const BusEvidence> cameras, const BusSurroundings& around) {
  std::vector<DoctorCheck> list;
  Checks of_all(list);
  const BusEvidence& first = cameras.front();
  const bool has_several = cameras.size() > 1;
  const bool is_usable = std::any_of(cameras.begin(), cameras.end(), [](const auto& e) { return e.frames() > 0; });
  check_domain(around, of_all);
  check_services(around, of_all);
  check_simulated_time(first, around, of_all);
  bool has_depth = false;
  for (const BusEvidence& evidence : cameras) {
    Checks checks(list, has_several ? evidence.camera_name() : "",
                  has_several && is_usable ? CheckStatus::kWarning : CheckStatus::kError);
    if (!check_one_camera(evidence, around, checks)) continue;
    if (has_several) check_frames(evidence, checks);
    has_depth = true;
  }
  if (has_depth) {
    const auto usable = std::find_if(cameras.begin(), cameras.end(), [](const auto& e) { return e.frames() > 0; });
    check_robot(usable == cameras.end() ? first : *usable, of_all);
    if (!has_several) check_frames(first, of_all);
  }
  if (has_several) check_together(cameras, of_all);
  check_buffer(cameras, around, of_all);
  return list;
}

}  // namespace prescene::service
