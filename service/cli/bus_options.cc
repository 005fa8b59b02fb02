// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "output_files.h"
#include "prescene/interfaces/bags/bag_reader.h"
#include "prescene/interfaces/bytes/file.h"
#include "prescene/interfaces/bytes/text.h"
#include "prescene/interfaces/scene_files/learned_file.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/camera_presets.h"
#include "verb.h"

namespace prescene::service {
namespace {

constexpr int kLastDomain = 230;

/// What a flag `--NAME,!--no-NAME` says that was given `count` times more often than its opposite.
bool says_yes(const char* name, std::int64_t count) {
  if (count == 0) throw CLI::ValidationError(name, "it is given together with its opposite: leave one of the two out");
  return count > 0;
}

}  // namespace

void add_domain_option(CLI::App& verb, interfaces::DdsOptions& dds) {
  auto* group = verb.add_option_group("Bus", "How to join the DDS bus");
  group->add_option("--domain", dds.domain, "DDS domain; default: that of ROS_DOMAIN_ID, else 0")
      ->check(CLI::Range(0, kLastDomain));
  group
      ->add_option("--interface", dds.interfaces,
                   "Network interface to use, such as eth0, or lo for this machine only; may be given several times; "
                   "default: one that Cyclone DDS chooses")
      ->allow_extra_args(false);
  group
      ->add_option("--peer", dds.peers,
                   "Machine on which to look for participants where multicast does not go, by address or name; may be "
                   "given several times")
      ->allow_extra_args(false);
  const std::map<std::string, interfaces::RosDistro> distros = {{"humble", interfaces::RosDistro::kHumble},
                                                                {"jazzy", interfaces::RosDistro::kJazzy}};
  group
      ->add_option_function<std::string>(
          "--ros-distro", [&dds, distros](const std::string& name) { dds.ros_distro = distros.at(name); },
          "Show up in `ros2 node list` of this release (humble or jazzy); topics work without")
      ->check(one_of({"humble", "jazzy"}));
  group
      ->add_option_function<std::string>(
          "--security", [&dds](const std::string& folder) { dds.security = folder; },
          "Folder with keys and permissions for DDS Security (docs/reference/security.md)")
      ->check(file_name());
}

core::Status take_domain(const CLI::App& verb, interfaces::DdsOptions& dds) {
  const char* variable = std::getenv("ROS_DOMAIN_ID");
  if (verb.get_option("--domain")->count() > 0 || variable == nullptr || *variable == '\0') return core::ok_status();
  const std::string text = variable;
  int domain = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), domain);
  if (error != std::errc() || end != text.data() + text.size() || domain < 0 || domain > kLastDomain)
    return core::invalid_input("the environment's ROS_DOMAIN_ID is " + interfaces::quote(text) +
                               ", not a whole number from 0 to 230: set it to one, or give --domain");
  dds.domain = domain;
  return core::ok_status();
}

void add_bus_options(CLI::App& verb, interfaces::DdsOptions& dds, TrackerSettings& tracker) {
  add_domain_option(verb, dds);
  add_topic_options(verb, tracker);
}

void add_topic_options(CLI::App& verb, TrackerSettings& tracker) {
  InputTopics& topics = tracker.topics;
  auto* group = verb.add_option_group("Topics", "Names of the robot's topics");
  std::vector<std::string> presets;
  for (const CameraPreset& preset : camera_presets()) presets.emplace_back(preset.name);
  // First: options run in their order, and what is named by itself takes precedence.
  group
      ->add_option_function<std::string>(
          "--camera", [&tracker](const std::string& name) { apply(*find_camera_preset(name), tracker); },
          "Names that the driver of this camera gives its topics, instead of the defaults below")
      ->check(one_of(presets));
  group->add_option("--depth-topic", topics.depth)->check(utf8_text())->capture_default_str();
  group->add_option("--color-topic", topics.color, "Empty = no colour")->check(utf8_text())->capture_default_str();
  group
      ->add_option(
          "--depth-form", topics.depth_form,
          "What the depth topic carries: image, compressed (compressedDepth) or points (PointCloud2); default: "
          "as its name says")
      ->check(one_of({"image", "compressed", "points"}));
  group
      ->add_option("--color-form", topics.color_form,
                   "What the colour topic carries: image or compressed (JPEG, PNG); default: as its name says")
      ->check(one_of({"image", "compressed"}));
  group->add_option("--camera-info-topic", topics.camera_info)->check(utf8_text())->capture_default_str();
  group->add_option("--tf-topic", topics.tf)->check(utf8_text())->capture_default_str();
  group->add_option("--tf-static-topic", topics.tf_static)->check(utf8_text())->capture_default_str();
  group
      ->add_option("--joint-states-topic", topics.joint_states,
                   "Positions of the joints of the scene's robot_description (sensor_msgs/JointState); empty = none")
      ->check(utf8_text())
      ->capture_default_str();
  group->add_flag_function(
      "--use-sim-time", [&topics](std::int64_t count) { topics.clock = count > 0 ? kClockTopic : ""; },
      "Time is simulated and published on /clock (rosgraph_msgs/Clock), as for nodes of ROS with use_sim_time");
}

core::Status check_topics_once(const CLI::App& verb, const belief::Scene& scene) {
  if (!names_topics(scene)) return core::ok_status();
  for (const char* name : {"--camera", "--depth-topic", "--color-topic", "--depth-form", "--color-form",
                           "--camera-info-topic", "--camera-pose", "--rectified"}) {
    const CLI::Option* option = verb.get_option_no_throw(name);
    if (option != nullptr && option->count() > 0)
      return core::invalid_input(std::string(name) +
                                 " is for a scene that does not list its cameras: change the entry under 'cameras' "
                                 "in the scene file instead");
  }
  return core::ok_status();
}

void add_input_options(CLI::App& verb, double& depth_scale, double& frame_rate, RecordingReadOptions& read) {
  verb.add_option("--depth-scale", depth_scale, "Of a folder: metres per unit of the depth images")
      ->check(positive_number())
      ->capture_default_str();
  verb.add_option("--frame-rate", frame_rate, "Of a folder: frames a second")
      ->check(positive_number())
      ->capture_default_str();
  verb.add_flag("--all-parts", read.all_parts,
                "Of a recording that goes on in several files, also those after RECORDING (run_0001.mcap, ...)");
  verb.add_flag("--salvage", read.salvage,
                "Read what is sound of a damaged recording, and say what was left out, instead of refusing it");
}

void tell_what_goes_on(const ReplayInput& input, VerbContext& context) {
  if (input.goes_on_in().empty()) return;
  core::log(context.log(), core::LogLevel::kInfo,
            "the recording goes on in " + input.goes_on_in().string() + ", which is not read: --all-parts reads all");
}

void add_part_options(CLI::App& verb, PartLimits& limits) {
  const auto bytes = [](double megabytes) { return static_cast<std::uint64_t>(1e6 * megabytes); };
  verb.add_option("--part-seconds", limits.seconds,
                  "The recording goes on in a new file (run_0001.mcap, ...) after so many seconds; 0 = only before its "
                  "index gets too long to be read")
      ->check(number_between(0.0, 1e9))
      ->capture_default_str();
  verb.add_option_function<double>(
          "--part-megabytes", [&limits, bytes](const double& megabytes) { limits.bytes = bytes(megabytes); },
          "The same when a file has so many megabytes of what is new in it")
      ->check(number_between(1.0, 1e9));
  verb.add_option_function<double>(
          "--keep-megabytes", [&limits, bytes](const double& megabytes) { limits.keep_bytes = bytes(megabytes); },
          "Remove the oldest files of this recording while all of them have more, those of earlier runs under the same "
          "name included; the newest two stay")
      ->check(number_between(1.0, 1e9));
}

core::Status check_folder_options(const CLI::App& verb, const std::string& input) {
  if (!interfaces::is_bag(input)) return core::ok_status();
  for (const char* name : {"--depth-scale", "--frame-rate"}) {
    const CLI::Option* option = verb.get_option_no_throw(name);
    if (option != nullptr && option->count() > 0)
      return core::invalid_input(std::string(name) + " is for folders of images, and " + input +
                                 " is none: leave it out");
  }
  return core::ok_status();
}

void add_camera_options(CLI::App& verb, AssemblerSettings& assembler) {
  auto* group = verb.add_option_group("Camera", "Where the camera is");
  group->add_option("--world-frame", assembler.world_frame, "Frame of the scene in tf")
      ->check(utf8_text())
      ->check([](const std::string& text) {
        return std::string(text.empty() ? "the name of a frame is needed, not ''" : "");
      })
      ->capture_default_str();
  group
      ->add_option_function<std::vector<double>>(
          "--camera-pose",
          [&assembler](const std::vector<double>& numbers) {
            const geometry::Pose X_WC{{numbers[3], numbers[4], numbers[5], numbers[6]},
                                      {numbers[0], numbers[1], numbers[2]}};
            if (!X_WC.is_finite() || std::abs(X_WC.rotation.norm() - 1.0) > 0.01) {
              throw CLI::ValidationError("--camera-pose",
                                         "x y z qw qx qy qz: the last four are a unit quaternion, real part first");
            }
            assembler.X_WC = geometry::normalized(X_WC);
          },
          "Pose of the camera where tf has none: x y z qw qx qy qz (m)")
      ->expected(7);
  group->add_flag_function(
      "--rectified,!--not-rectified",
      [&assembler](std::int64_t count) { assembler.rectified = says_yes("--rectified", count); },
      "Whether the images are rectified: P of the camera info is used then, not K and D; default: if the depth topic "
      "is named image_rect...");
}

void add_web_options(CLI::App& verb, const std::string& prefix, ViewOptions& view) {
  auto* group = verb.add_option_group("Web", "Who may look");
  group
      ->add_option("--" + prefix + "address", view.address,
                   "Numeric address to listen on; on any but this machine's own, others need the token")
      ->check(utf8_text())
      ->capture_default_str();
  group->add_option("--" + prefix + "token", view.token,
                    "Secret that the page's address holds; default: a random one where other machines reach it");
  group
      ->add_option("--" + prefix + "origin", view.allowed_origins,
                   "Origin of a page of somebody else's that may connect, as https://app.example.org; repeatable")
      ->check(utf8_text());
}

void add_likelihood_options(CLI::App& verb, rendering::LikelihoodChoice& choice) {
  const std::map<std::string, rendering::Weigher> names = {{"automatic", rendering::Weigher::kAutomatic},
                                                           {"processor", rendering::Weigher::kProcessor},
                                                           {"graphics", rendering::Weigher::kGraphics}};
  verb.add_option_function<std::string>(
          "--likelihood", [&choice, names](const std::string& name) { choice.weigher = names.at(name); },
          "What scores poses, with the same bits: the processor; graphics (OpenGL 4.3, also in software); automatic: a "
          "graphics card where there is one")
      ->check(one_of({"automatic", "processor", "graphics"}))
      ->default_str("automatic");
  verb.add_option("--graphics-device", choice.device, "Which of EGL's devices, from 0 on; -1 = the first that will do")
      ->check(CLI::Range(-1, 31))
      ->capture_default_str();
}

void add_proposals_option(CLI::App& verb, std::string& path) {
  verb.add_option("--proposals", path,
                  "File of `prescene train` for this scene: what it learned is used wherever objects are looked for")
      ->check(file_name());
}

void add_belief_options(CLI::App& verb, TrackerSettings& settings, std::string& learned) {
  verb.add_option("--learned", learned,
                  "File in which what is learned of friction, mass, ... is kept: read at the start if it is there, "
                  "written in the end (docs/reference/scene_files.md)")
      ->check(file_name());
  verb.add_flag_function(
      "--new-objects,!--no-new-objects",
      [&settings](std::int64_t count) { settings.new_objects = says_yes("--new-objects", count); },
      "Whether to look for things that the scene does not name; default: as the scene says (new_objects)");
}

core::Status take_learned(const std::string& file, const std::vector<std::string>& inputs, TrackerSettings& settings) {
  if (file.empty()) return core::ok_status();
  PRESCENE_RETURN_IF_ERROR(check_output("--learned", file, inputs));
  settings.learned.clear();
  settings.learned_file = file;
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return core::ok_status();
  PRESCENE_TRY(const std::vector<std::uint8_t> bytes, interfaces::read_file(file, interfaces::YamlLimits{}.max_bytes));
  settings.learned.assign(bytes.begin(), bytes.end());
  // Here, so that it is reported before anything is opened; and an empty file is none that was learned.
  return interfaces::parse_learned(settings.learned, file).status();
}

TrackerSettings with_given(const CLI::App& verb, TrackerSettings settings, const TrackerSettings& given) {
  const auto take = [&verb](const char* option, auto& to, const auto& from) {
    const CLI::Option* found = verb.get_option_no_throw(option);
    if (found != nullptr && found->count() > 0) to = from;
  };
  const CLI::Option* camera = verb.get_option_no_throw("--camera");
  if (camera != nullptr && camera->count() > 0) {
    settings.topics.depth = given.topics.depth;
    settings.topics.color = given.topics.color;
    settings.topics.camera_info = given.topics.camera_info;
    settings.assembler.rectified = given.assembler.rectified;
  }
  take("--depth-topic", settings.topics.depth, given.topics.depth);
  take("--color-topic", settings.topics.color, given.topics.color);
  take("--depth-form", settings.topics.depth_form, given.topics.depth_form);
  take("--color-form", settings.topics.color_form, given.topics.color_form);
  take("--camera-info-topic", settings.topics.camera_info, given.topics.camera_info);
  take("--tf-topic", settings.topics.tf, given.topics.tf);
  take("--tf-static-topic", settings.topics.tf_static, given.topics.tf_static);
  take("--joint-states-topic", settings.topics.joint_states, given.topics.joint_states);
  take("--use-sim-time", settings.topics.clock, given.topics.clock);
  take("--world-frame", settings.assembler.world_frame, given.assembler.world_frame);
  take("--camera-pose", settings.assembler.X_WC, given.assembler.X_WC);
  take("--rectified", settings.assembler.rectified, given.assembler.rectified);
  take("--learned", settings.learned, given.learned);
  take("--learned", settings.learned_file, given.learned_file);
  take("--new-objects", settings.new_objects, given.new_objects);
  return settings;
}

}  // namespace prescene::service
