// SPDX-License-Identifier: Apache-2.0
#include "prescene/service/live/doctor.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "prescene/core/text.h"
#include "prescene/interfaces/reports/lettering.h"
#include "prescene/service/live/bus_evidence.h"
#include "prescene/service/live/inbox.h"
#include "prescene/service/pictures/scene_overlay.h"
#include "prescene/service/tracking/camera_frames.h"

namespace prescene::service {
namespace {

using core::fixed_text;

constexpr std::chrono::milliseconds kLookInterval(20);
// As much of the image should show the scene, and as much of that should lie where the scene has it.
constexpr double kLeastInView = 0.02;
constexpr double kLeastFitting = 0.5;
// Of a camera's name in its picture.
constexpr double kNameHeight = 14.0;
constexpr geometry::Rgb kNameColor = {20, 20, 20};

/// How many datagrams this machine has lost since it started because a receive buffer was full; 0 where it does not
/// say.
std::uint64_t lost_datagrams() {
  std::ifstream file("/proc/net/snmp");
  std::string names;
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with("Udp:")) continue;
    if (names.empty()) {
      names = line;
      continue;
    }
    std::istringstream name_words(names);
    std::istringstream value_words(line);
    std::string name;
    std::string value;
    while (name_words >> name && value_words >> value)
      if (name == "RcvbufErrors") return std::strtoull(value.c_str(), nullptr, 10);
  }
  return 0;
}

/// Variables that keep the nodes of ROS that heed them to one machine.
std::map<std::string, std::string> keeping_local() {
  std::map<std::string, std::string> found;
  const auto value_of = [](const char* name) {
    const char* value = std::getenv(name);
    return std::string(value == nullptr ? "" : value);
  };
  if (value_of("ROS_LOCALHOST_ONLY") == "1") found["ROS_LOCALHOST_ONLY"] = "1";
  const std::string range = value_of("ROS_AUTOMATIC_DISCOVERY_RANGE");
  if (range == "LOCALHOST" || range == "OFF") found["ROS_AUTOMATIC_DISCOVERY_RANGE"] = range;
  return found;
}

void check_view(const belief::Scene& scene, const SurroundingsFit& fit, const std::string& camera, bool is_listed,
                std::vector<DoctorCheck>& checks) {
  if (scene.supports.empty() && scene.robot.empty()) return;
  const auto percent = [](double share) { return fixed_text(100.0 * share, 0) + " %"; };
  const std::string remedy = std::string("look at the picture of --overlay; correct tf, ") +
                             (is_listed ? "the camera's 'pose'" : "--camera-pose") +
                             ", --world-frame, or the supports in the scene file";
  if (fit.in_view < kLeastInView) {
    checks.push_back({"view", camera, CheckStatus::kWarning,
                      "the scene's supports and robot fill " + percent(fit.in_view) + " of the image", remedy});
    return;
  }
  const std::string what = "the scene's supports and robot fill " + percent(fit.in_view) + " of the image; " +
                           percent(fit.fitting) + " of the depth there is within 2 cm of theirs, the median is " +
                           fixed_text(1e3 * fit.median_difference, 0) + " mm off";
  if (fit.fitting < kLeastFitting)
    checks.push_back({"view", camera, CheckStatus::kWarning, what, remedy});
  else
    checks.push_back({"view", camera, CheckStatus::kOk, what, ""});
}

std::vector<ExaminedTopic> examined(const std::vector<interfaces::DomainTopic>& topics,
                                    std::span<const BusEvidence> cameras) {
  std::vector<ExaminedTopic> list;
  for (const interfaces::DomainTopic& topic : topics) {
    ExaminedTopic& row = list.emplace_back(ExaminedTopic{topic, 0, std::nullopt});
    for (const BusEvidence& evidence : cameras) {
      const auto seen = evidence.topics().find(topic.name);
      if (seen == evidence.topics().end()) continue;
      row.messages = seen->second.messages;
      row.rate = seen->second.rate();
      break;
    }
  }
  return list;
}

/// Below `above`, with its name.
void add_below(const std::string& name, const geometry::ColorImage& picture, geometry::ColorImage& above) {
  geometry::ColorImage both(std::max(above.width(), picture.width()), above.height() + picture.height());
  const auto copy = [&both](const geometry::ColorImage& from, int top) {
    for (int y = 0; y < from.height(); ++y)
      for (int x = 0; x < from.width(); ++x) both(x, top + y) = from(x, y);
  };
  copy(above, 0);
  copy(picture, above.height());
  interfaces::draw_label(name, {4.0, above.height() + 18.0}, kNameHeight, kNameColor, both);
  above = std::move(both);
}

}  // namespace

const char* to_string(CheckStatus status) {
  switch (status) {
    case CheckStatus::kOk:
      return "ok";
    case CheckStatus::kWarning:
      return "warning";
    case CheckStatus::kError:
      return "error";
  }
  return "";
}

bool Diagnosis::usable() const {
  return std::none_of(checks.begin(), checks.end(),
                      [](const DoctorCheck& check) { return check.status == CheckStatus::kError; });
}

nlohmann::ordered_json to_json(const Diagnosis& diagnosis) {
  nlohmann::ordered_json json = {{"usable", diagnosis.usable()},
                                 {"checks", nlohmann::ordered_json::array()},
                                 {"topics", nlohmann::ordered_json::array()}};
  for (const DoctorCheck& check : diagnosis.checks) {
    nlohmann::ordered_json& entry = json["checks"].emplace_back();
    entry["check"] = check.name;
    if (!check.camera.empty()) entry["camera"] = check.camera;
    entry.update(
        nlohmann::ordered_json{{"status", to_string(check.status)}, {"what", check.what}, {"remedy", check.remedy}});
  }
  for (const ExaminedTopic& row : diagnosis.topics)
    json["topics"].push_back({{"topic", row.topic.name},
                              {"type", row.topic.type},
                              {"writers", row.topic.writers},
                              {"readers", row.topic.readers},
                              {"messages", row.messages},
                              {"rate", row.rate ? nlohmann::ordered_json(*row.rate) : nlohmann::ordered_json()}});
  return json;
}

core::Result<Diagnosis> examine_bus(const DoctorOptions& options, const std::shared_ptr<const belief::Scene>& scene,
                                    Backends& backends, const core::Cancellation& cancellation,
                                    const core::ProgressSink& progress, const core::LogSink& log) {
  const std::vector<CameraInput> inputs = camera_inputs(options.tracker, scene ? *scene : belief::Scene());
  PRESCENE_RETURN_IF_ERROR(validate(inputs));
  constexpr InboxLimit kImages{.messages = 8, .bytes = std::size_t{128} << 20};
  std::map<std::string, InboxLimit> limits = {{options.tracker.topics.tf, {.messages = 10'000}},
                                              {options.tracker.topics.joint_states, {.messages = 10'000}}};
  std::vector<BusEvidence> cameras;
  for (const CameraInput& input : inputs) {
    limits.insert({{input.topics.depth, kImages}, {input.topics.color, kImages}});
    TrackerSettings settings = options.tracker;
    settings.topics = input.topics;
    settings.assembler = input.assembler;
    cameras.emplace_back(settings, scene.get(), input.name);
  }
  Inbox inbox(limits);
  interfaces::DdsOptions dds = options.dds;
  dds.node_name = "prescene_doctor";
  dds.find_interfaces = true;
  const std::uint64_t lost_before = lost_datagrams();
  PRESCENE_TRY(const auto node, interfaces::DdsNode::create(dds, log));
  for (const BusTopic& topic : topics_of_cameras(inputs)) {
    const bool is_read = std::any_of(cameras.begin(), cameras.end(), [&](const BusEvidence& evidence) {
      return evidence.topics().contains(topic.name);
    });
    if (!is_read) continue;  // ours
    PRESCENE_RETURN_IF_ERROR(
        node->subscribe(topic.name, topic.type, topic.read,
                        [&inbox](interfaces::ReceivedMessage&& message) { inbox.put(std::move(message)); }));
  }
  const core::Stopwatch watch;
  while (watch.seconds() < options.seconds) {
    if (cancellation.requested()) return core::cancelled("stopped on request");
    for (const auto& message : inbox.take_all(std::chrono::steady_clock::now() + kLookInterval))
      for (BusEvidence& evidence : cameras) evidence.add(message, core::wall_now_ns());
    for (BusEvidence& evidence : cameras) evidence.take_frames(core::steady_now_ns());
    if (progress) progress({std::min(1.0, watch.seconds() / options.seconds), {}, ""});
  }
  node->stop_receiving();
  BusSurroundings around;
  around.domain = dds.domain;
  around.interfaces = node->interfaces();
  around.participants = node->other_participants();
  around.other_services = node->other_writers(kBeliefTopic);
  around.topics = node->domain_topics();
  around.asked_buffer = dds.receive_buffer_bytes;
  around.granted_buffer = interfaces::granted_receive_buffer(dds.receive_buffer_bytes);
  around.lost_datagrams = lost_datagrams() - lost_before;
  around.ros = keeping_local();

  Diagnosis diagnosis;
  diagnosis.checks = checks_of(cameras, around);
  diagnosis.topics = examined(around.topics, cameras);
  for (const BusEvidence& evidence : cameras) {
    if (!evidence.newest()) continue;
    const belief::Observation& frame = evidence.newest()->observation;
    if (!diagnosis.frame) diagnosis.frame = frame;
    if (!scene) continue;
    PRESCENE_TRY(SceneOverlay overlay, scene_overlay(*scene, frame, backends));
    const std::string& name = evidence.camera_name();
    if (cameras.size() == 1)
      diagnosis.overlay = std::move(overlay.picture);
    else
      add_below(name, overlay.picture, diagnosis.overlay);
    check_view(*scene, overlay.fit, cameras.size() == 1 ? "" : name, !name.empty(), diagnosis.checks);
  }
  return diagnosis;
}

}  // namespace prescene::service
