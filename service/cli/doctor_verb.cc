// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "output_files.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/service/live/doctor.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/tracking/camera_presets.h"
#include "verb.h"

namespace prescene::service {
namespace {

struct DoctorVerbOptions {
  std::string scene;
  std::string overlay;
  DoctorOptions doctor;
  const CLI::App* verb = nullptr;
};

/// Reads the scene; what is wrong with it is a check as well. Null where it can't be used.
core::Result<std::shared_ptr<const belief::Scene>> check_scene_file(const std::string& file, DoctorCheck& check,
                                                                    const core::LogSink& log) {
  PRESCENE_TRY(const std::string text, read_scene_text(file));
  std::vector<std::string> warnings;
  const core::LogSink keep = [&](core::LogLevel level, const std::string& line) {
    if (level >= core::LogLevel::kWarning) warnings.push_back(line);
    core::log(log, level, line);
  };
  const auto scene = load_scene_text(text, file, keep);
  check.name = "scene";
  if (!scene) {
    check.status = CheckStatus::kError;
    check.what = scene.status().message();
    check.remedy = "correct the file as each line says; prescene validate " + file + " checks it again";
    return std::shared_ptr<const belief::Scene>();
  }
  check.what = file + ": " + counted((*scene)->objects.size(), "object") + ", " +
               counted((*scene)->supports.size(), "support") + ", " + counted((*scene)->robot.size(), "part") +
               " of the robot";
  if (!warnings.empty()) {
    check.status = CheckStatus::kWarning;
    check.what += "; " + warnings.front() +
                  (warnings.size() > 1 ? " (and " + counted(warnings.size() - 1, "more warning") + ")" : "");
    check.remedy = "prescene validate " + file + " says all";
  }
  return *scene;
}

std::string text_of(const Diagnosis& diagnosis) {
  std::string text;
  std::size_t width = 18;
  const auto name_of = [](const DoctorCheck& check) {
    return (check.camera.empty() ? "" : check.camera + ": ") + check.name;
  };
  for (const DoctorCheck& check : diagnosis.checks)
    if (!check.camera.empty()) width = std::max(width, std::min<std::size_t>(40, name_of(check).size()));
  for (const DoctorCheck& check : diagnosis.checks) {
    std::string name = name_of(check);
    name.resize(std::max(name.size(), width), ' ');
    std::string status = to_string(check.status);
    status.resize(7, ' ');
    text += status + "  " + name + "  " + check.what + "\n";
    if (!check.remedy.empty()) text += "         " + std::string(width, ' ') + "  -> " + check.remedy + "\n";
  }
  std::vector<std::vector<std::string>> rows = {{"topic", "type", "writers", "readers", "rate"}};
  for (const ExaminedTopic& row : diagnosis.topics)
    rows.push_back({row.topic.name, row.topic.type, std::to_string(row.topic.writers),
                    std::to_string(row.topic.readers), row.rate ? core::fixed_text(*row.rate, 1) + " Hz" : ""});
  if (rows.size() > 1) text += "\n" + table(rows);
  std::size_t errors = 0;
  std::size_t warnings = 0;
  for (const DoctorCheck& check : diagnosis.checks) {
    errors += check.status == CheckStatus::kError ? 1 : 0;
    warnings += check.status == CheckStatus::kWarning ? 1 : 0;
  }
  return text + "\n" + (diagnosis.usable() ? "usable" : "not usable") + ": " + counted(errors, "error") + ", " +
         counted(warnings, "warning") + "\n";
}

core::Status run(DoctorVerbOptions& options, VerbContext& context) {
  for (const char* extension : {".mcap", ".db3"})
    if (options.scene.ends_with(extension) || std::filesystem::is_directory(options.scene))
      return core::invalid_input(options.scene + " is a recording, and doctor looks at the bus: `prescene inspect " +
                                 options.scene + "` says what is in it and what is wrong with it");
  PRESCENE_RETURN_IF_ERROR(validate(options.doctor.tracker.topics));
  PRESCENE_RETURN_IF_ERROR(take_domain(*options.verb, options.doctor.dds));
  if (!options.overlay.empty() && options.scene.empty())
    return core::invalid_input("--overlay draws a scene over the camera's image: name the scene file as well");
  PRESCENE_RETURN_IF_ERROR(check_png("--overlay", options.overlay));
  PRESCENE_RETURN_IF_ERROR(check_output("--overlay", options.overlay, {options.scene}));
  std::shared_ptr<const belief::Scene> scene;
  DoctorCheck scene_check;
  if (!options.scene.empty()) {
    PRESCENE_TRY(scene, check_scene_file(options.scene, scene_check, context.log()));
    if (scene) {
      PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *scene));
      PRESCENE_TRY(const std::string text, read_scene_text(options.scene));
      PRESCENE_TRY(options.doctor.tracker.assembler.robot, load_robot(text, options.scene));
    }
  }
  for (const CameraInput& camera : camera_inputs(options.doctor.tracker, scene ? *scene : belief::Scene()))
    core::log(context.log(), core::LogLevel::kInfo,
              "listening for " + core::fixed_text(options.doctor.seconds, 1) + " s in DDS domain " +
                  std::to_string(options.doctor.dds.domain) + (camera.name.empty() ? "" : " to camera " + camera.name) +
                  ": " + topics_text(camera.topics));
  Backends backends(context.pool());
  auto examined = examine_bus(options.doctor, scene, backends, context.cancellation(), context.progress("listening"),
                              context.log());
  context.end_progress();
  if (!examined) return examined.status();
  Diagnosis diagnosis = *std::move(examined);
  if (!options.scene.empty()) diagnosis.checks.insert(diagnosis.checks.begin(), scene_check);
  const bool drawn = !options.overlay.empty() && !diagnosis.overlay.empty();
  if (drawn) {
    PRESCENE_RETURN_IF_ERROR(interfaces::write_png(options.overlay, std::as_const(diagnosis.overlay).view()));
    core::log(context.log(), core::LogLevel::kInfo, "overlay written to " + options.overlay);
  } else if (!options.overlay.empty()) {
    core::log(context.log(), core::LogLevel::kWarning, "no frame could be used, so there is no overlay");
  }
  nlohmann::ordered_json document = {{"domain", options.doctor.dds.domain},
                                     {"seconds", options.doctor.seconds},
                                     {"overlay", drawn ? options.overlay : ""}};
  document.update(to_json(diagnosis));
  context.print(document, text_of(diagnosis));
  if (diagnosis.usable()) return core::ok_status();
  return core::unavailable("the service could not track like this");
}

}  // namespace

Verb add_doctor_verb(CLI::App& app) {
  auto* verb = app.add_subcommand(
      "doctor", "Look at the robot's topics before anything is tracked: what would go wrong, and what to do about it");
  auto options = std::make_shared<DoctorVerbOptions>();
  verb->add_option("SCENE", options->scene,
                   "Scene file that is to be tracked; without one, only the topics are checked")
      ->check(file_name());
  verb->add_option("--seconds", options->doctor.seconds, "How long to listen, s")
      ->check(number_between(0.5, 600.0))
      ->capture_default_str();
  verb->add_option("--overlay", options->overlay, "Write the camera's image with the scene drawn over it (PNG)")
      ->check(file_name());
  add_bus_options(*verb, options->doctor.dds, options->doctor.tracker);
  add_camera_options(*verb, options->doctor.tracker.assembler);
  options->verb = verb;
  verb->footer(
      "Exit code 0: `prescene serve` would track (there may be warnings); 1: it would not; 2: bad arguments.\n"
      "Example: prescene doctor scenarios/milk_on_bin.yaml --camera realsense --overlay seen.png");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
