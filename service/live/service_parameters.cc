// SPDX-License-Identifier: Apache-2.0
#include "service_parameters.h"

#include <array>
#include <string>
#include <utility>

namespace prescene::service {
namespace {

constexpr std::array<std::pair<const char*, core::LogLevel>, 4> kLevels = {{{"debug", core::LogLevel::kDebug},
                                                                            {"info", core::LogLevel::kInfo},
                                                                            {"warning", core::LogLevel::kWarning},
                                                                            {"error", core::LogLevel::kError}}};
// Of questions, s: as the options of `serve`.
constexpr std::pair kQuestionSeconds{1e-3, 3600.0};
// A second: slower is as good as nothing, faster is more than a reader can use.
constexpr std::pair kRates{0.1, 100.0};

NodeParameter settable_number(std::string name, std::string description, double value, std::pair<double, double> range,
                              const std::function<void(double)>& hook) {
  return {std::move(name), std::move(description), value,
          [hook](const ParameterValue& set) { hook(std::get<double>(set)); }, range};
}

std::vector<double> numbers_of(const std::optional<geometry::Pose>& X_WC) {
  if (!X_WC) return {};
  const auto& p = X_WC->translation;
  const auto& q = X_WC->rotation;
  return {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()};
}

std::string word_of(std::optional<interfaces::RosDistro> distro) {
  if (!distro) return "";
  return *distro == interfaces::RosDistro::kHumble ? "humble" : "jazzy";
}

void add_settable(const belief::Scene& scene, const LiveSettings& settings, const ParameterHooks& hooks,
                  std::vector<NodeParameter>& parameters) {
  const auto number = [&](auto... arguments) { parameters.push_back(settable_number(arguments...)); };
  number("question_seconds", "Time that a question without limits of its own may take, s.",
         settings.worker.default_seconds, kQuestionSeconds, hooks.question_seconds);
  number("most_question_seconds", "Time that any question may take, s.", settings.worker.most_seconds, kQuestionSeconds,
         hooks.most_question_seconds);
  number("history", "Frames of so many seconds are kept, so that it can be asked what happened; 0 = none.",
         settings.frames.seconds, std::pair(0.0, 3600.0), hooks.history);
  number("marker_rate", "Markers a second, at most.", settings.marker_rate, kRates, hooks.marker_rate);
  number("diagnostics_rate", "Diagnostics a second, at most.", settings.diagnostics_rate, kRates,
         hooks.diagnostics_rate);
  number("learned_interval", "What was learned is written at most once in so many seconds (--learned).",
         settings.learned_interval, std::pair(1.0, 3600.0), hooks.learned_interval);
  number("max_wait", "A depth image waits so long, s, for its colour image, camera info and tf.",
         settings.tracker.assembler.max_wait_s, std::pair(0.0, 1.0), hooks.max_wait);
  number("max_stamp_difference", "Stamps of a depth image and its colour image differ by so much, s, at most.",
         settings.tracker.assembler.max_stamp_difference_s, std::pair(0.0, 0.5), hooks.max_stamp_difference);
  parameters.push_back({"new_objects", "Whether things are looked for that the scene does not name.",
                        settings.tracker.new_objects.value_or(scene.new_objects),
                        [hook = hooks.new_objects](const ParameterValue& set) { hook(std::get<bool>(set)); }});
  NodeParameter level{"log_level", "Lines that matter less are not logged; --quiet leaves out info in any case.",
                      "info", [hook = hooks.log_level](const ParameterValue& set) {
                        for (const auto& [word, value] : kLevels)
                          if (std::get<std::string>(set) == word) hook(value);
                      }};
  for (const auto& [word, value] : kLevels) level.words.emplace_back(word);
  parameters.push_back(std::move(level));
}

/// "eth0 wlan0".
std::string names_text(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
  return text;
}

}  // namespace

std::vector<NodeParameter> service_parameters(const belief::Scene& scene, const LiveSettings& settings,
                                              const ParameterHooks& hooks) {
  std::vector<NodeParameter> parameters = settings.started_with;
  add_settable(scene, settings, hooks, parameters);
  const auto fixed = [&](const char* name, ParameterValue value, const char* description) {
    parameters.push_back({name, description, std::move(value)});
  };
  const InputTopics& topics = settings.tracker.topics;
  fixed("depth_topic", topics.depth, "Topic of the depth images.");
  fixed("depth_form", topics.depth_form, "What the depth topic carries; empty = as its name says.");
  fixed("color_topic", topics.color, "Topic of the colour images; empty = none.");
  fixed("color_form", topics.color_form, "What the colour topic carries; empty = as its name says.");
  fixed("camera_info_topic", topics.camera_info, "Topic of the camera infos.");
  fixed("tf_topic", topics.tf, "Topic of the transforms.");
  fixed("publish_tf", settings.publish_tf, "Whether the objects' poses are published there, too.");
  fixed("overlay_rate", settings.overlay_rate, "Pictures of the overlay a second, at most; 0 = none.");
  fixed("planning_scene", settings.planning_scene, "Whether MoveIt is told where the objects are.");
  fixed("planning_scene_supports", settings.planning_supports, "Whether it is told of the supports, too.");
  fixed("tf_static_topic", topics.tf_static, "Topic of the static transforms.");
  fixed("joint_states_topic", topics.joint_states, "Topic of the joint states; empty = none.");
  fixed("use_sim_time", !topics.clock.empty(), "Whether time is simulated, and comes on /clock.");
  fixed("world_frame", settings.tracker.assembler.world_frame, "Frame of the scene in tf.");
  fixed("camera_pose", numbers_of(settings.tracker.assembler.X_WC),
        "Pose of the camera where tf has none, x y z qw qx qy qz (m); empty = tf must have it.");
  fixed("rectified", is_rectified(settings.tracker), "Whether the images are taken as rectified.");
  fixed("domain", std::int64_t{settings.dds.domain}, "DDS domain.");
  fixed("interfaces", names_text(settings.dds.interfaces),
        "Network interfaces that are used; empty = the middleware chose.");
  fixed("peers", names_text(settings.dds.peers),
        "Machines on which participants are looked for; empty = by multicast only.");
  fixed("ros_distro", word_of(settings.dds.ros_distro), "Release in whose form the node is announced; empty = none.");
  fixed("security", settings.dds.security.string(), "Folder with keys and permissions of DDS Security; empty = none.");
  fixed("learned", settings.learned_file.string(), "File in which what is learned is kept; empty = none.");
  return parameters;
}

}  // namespace prescene::service
