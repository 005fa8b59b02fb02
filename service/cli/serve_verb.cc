// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "output_files.h"
#include "prescene/belief/json.h"
#include "prescene/interfaces/scene_files/scene_file.h"
#include "prescene/service/live/live_service.h"
#include "prescene/service/load_scene.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/training/proposals_file.h"
#include "prescene/service/view/live_view.h"
#include "verb.h"

namespace prescene::service {
namespace {

struct ServeOptions {
  std::string scene;
  std::string record;
  PartLimits parts;
  std::string proposals;
  std::string learned;
  LiveSettings settings;
  BackendSettings backends;
  ViewOptions view;
  const CLI::App* verb = nullptr;
};

/// The page, and what the service hands over to it; null where none was asked for.
core::Result<std::unique_ptr<LiveView>> open_view(ServeOptions& options,
                                                  const std::shared_ptr<const belief::Scene>& scene,
                                                  VerbContext& context) {
  if (options.verb->count("--view") == 0) return std::unique_ptr<LiveView>();
  options.view.world_frame = options.settings.tracker.assembler.world_frame;
  PRESCENE_TRY(auto view, LiveView::create(scene, options.view, context.log()));
  LiveView* raw = view.get();
  options.settings.on_step = [raw](const TrackerStep& step, const std::shared_ptr<const belief::Belief>& belief) {
    raw->show({belief, step.observation, step.record.seconds, step.record.degraded});
  };
  options.settings.on_answer = [raw](const std::string& answer) { raw->answer(answer); };
  options.settings.on_health = [raw](const std::string& health) { raw->set_health(health); };
  core::log(context.log(), core::LogLevel::kInfo, "to be seen at " + view->url());
  return view;
}

core::Status run(ServeOptions& options, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(validate(options.settings.tracker.topics));
  PRESCENE_RETURN_IF_ERROR(take_domain(*options.verb, options.settings.dds));
  PRESCENE_TRY(const std::string text, read_scene_text(options.scene));
  FilesOfScene files;
  PRESCENE_TRY(const auto scene, load_scene_text(text, options.scene, context.log(),
                                                 options.record.empty() ? nullptr : &files, Symmetries::kSuggested));
  PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *scene));
  PRESCENE_RETURN_IF_ERROR(validate(camera_inputs(options.settings.tracker, *scene)));
  PRESCENE_TRY(options.settings.tracker.assembler.robot, load_robot(text, options.scene));
  auto weights = interfaces::parse_event_weights(text, options.scene);
  if (!weights) return weights.status();
  options.settings.event_weights = *weights;
  if (!options.proposals.empty()) {
    PRESCENE_TRY(options.settings.tracker.filter.learned, load_proposals(options.proposals, *scene));
  }
  PRESCENE_RETURN_IF_ERROR(check_recording("--record", options.record, {options.scene}));
  PRESCENE_RETURN_IF_ERROR(check_part_limits(options.record, options.parts));
  PRESCENE_RETURN_IF_ERROR(check_apart("--learned", options.learned, "--record", options.record));
  PRESCENE_RETURN_IF_ERROR(take_learned(options.learned, {options.scene}, options.settings.tracker));
  options.settings.learned_file = options.learned;
  std::unique_ptr<RollingRecording> recording;
  if (!options.record.empty()) {
    const std::string asked = std::exchange(options.record, live_recording_path(options.record, context));
    RecordingInfo info{options.scene, text, context.options().seed,
                       belief::json_text(to_json(options.settings.tracker)), std::move(files)};
    info.tf_static = options.settings.tracker.topics.tf_static;
    PRESCENE_TRY(recording, RollingRecording::create(
                                options.record, std::move(info),
                                {.part = options.parts, .asked = asked, .as_bag = names_bag(asked)}, context.log()));
  }
  const auto started_with = [&options](const char* name, ParameterValue value, const char* description) {
    options.settings.started_with.push_back({name, description, std::move(value)});
  };
  started_with("scene", options.scene, "Scene file.");
  std::string cameras;
  for (const CameraInput& camera : camera_inputs(options.settings.tracker, *scene))
    cameras += (cameras.empty() ? "" : ", ") + camera.name;
  started_with("cameras", cameras, "Cameras that the scene lists; empty = the one that the options tell of.");
  started_with("record", options.record, "Recording that is written; empty = none.");
  started_with("proposals", options.proposals, "File of `prescene train` that is used; empty = none.");
  started_with("seed", static_cast<std::int64_t>(context.options().seed), "Seed of all random numbers.");
  started_with("threads", std::int64_t{context.pool().threads()}, "Threads that track.");
  Backends backends(context.pool(), options.backends);
  PRESCENE_TRY(const auto view, open_view(options, scene, context));
  PRESCENE_TRY(const auto service, LiveService::create(scene, options.settings, context.options().seed, backends,
                                                       std::move(recording), context.log()));
  LiveService* asked = service.get();
  if (view) view->set_asker([asked](std::string question) { asked->ask(std::move(question)); });
  const core::Status ran = service->run(context.cancellation());
  if (view) view->set_asker({});
  PRESCENE_RETURN_IF_ERROR(ran);
  context.print({{"scene", scene->name}, {"recording", options.record}, {"learned", options.learned}}, "");
  return core::ok_status();
}

}  // namespace

Verb add_serve_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("serve", "Track a scene live: listen on DDS, publish the belief, answer questions");
  auto options = std::make_shared<ServeOptions>();
  verb->add_option("--scene", options->scene,
                   "Scene file: models, supports, robot, objects (docs/reference/scene_files.md)")
      ->required();
  verb->add_option("--record", options->record, "Record everything that comes in and what was done with it (MCAP)")
      ->check(file_name());
  add_part_options(*verb, options->parts);
  for (const char* name : {"--part-seconds", "--part-megabytes", "--keep-megabytes"})
    verb->get_option(name)->needs(verb->get_option("--record"));
  add_belief_options(*verb, options->settings.tracker, options->learned);
  verb->add_option("--question-seconds", options->settings.worker.default_seconds,
                   "Time that a question without limits of its own may take, s")
      ->check(number_between(1e-3, 3600.0))
      ->capture_default_str();
  verb->add_option("--most-question-seconds", options->settings.worker.most_seconds,
                   "Time that any question may take, s; of one client, one is simulated at a time")
      ->check(number_between(1e-3, 3600.0))
      ->capture_default_str();
  verb->add_option("--history", options->settings.frames.seconds,
                   "Frames of so many seconds are kept, so that `ask explain` can say what happened; 0 = none")
      ->check(number_between(0.0, 3600.0))
      ->capture_default_str();
  verb->add_option("--view", options->view.port,
                   "Port of a page for the browser that shows the belief live; 0 = any that is free")
      ->check(CLI::Range(0, 65535));
  add_web_options(*verb, "view-", options->view);
  for (const char* name : {"--view-address", "--view-token", "--view-origin"})
    verb->get_option(name)->needs(verb->get_option("--view"));
  verb->add_flag("!--no-tf", options->settings.publish_tf,
                 "Do not publish the objects' poses on the tf topic, as frames prescene/OBJECT");
  verb->add_option(
          "--overlay-rate", options->settings.overlay_rate,
          "Pictures of the camera with the belief drawn over it, on /prescene/overlay/image, a second at most; "
          "they are made only while somebody looks; 0 = none")
      ->check(number_between(0.0, 100.0))
      ->capture_default_str();
  verb->add_flag("--planning-scene", options->settings.planning_scene,
                 "Keep MoveIt's planning scene as the belief is, on /collision_object");
  verb->add_flag("--planning-scene-supports", options->settings.planning_supports, "Put the supports into it, too")
      ->needs(verb->get_option("--planning-scene"));
  add_proposals_option(*verb, options->proposals);
  add_bus_options(*verb, options->settings.dds, options->settings.tracker);
  add_camera_options(*verb, options->settings.tracker.assembler);
  add_likelihood_options(*verb, options->backends.likelihood);
  options->verb = verb;
  verb->footer(
      "Runs until Ctrl-C. Topics: docs/reference/ros2.md\n"
      "Examples: prescene serve --scene scenarios/milk_on_bin.yaml\n"
      "          prescene serve --scene scenarios/milk_on_bin.yaml --view 8765");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
