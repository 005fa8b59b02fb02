// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "prescene/service/load_scene.h"
#include "prescene/service/recording/replay_input.h"
#include "prescene/service/tracking/camera_frames.h"
#include "prescene/service/view/bus_view.h"
#include "prescene/service/view/recording_view.h"
#include "verb.h"

namespace prescene::service {
namespace {

struct ViewVerbOptions {
  std::string recording;
  std::string scene;
  RecordingReadOptions read;
  double depth_scale = 0.001;
  double frame_rate = 30.0;
  TrackerSettings tracker;
  BackendSettings backends;
  interfaces::DdsOptions dds;
  ViewOptions view;
  const CLI::App* verb = nullptr;
};

void wait_for_stop(const core::Cancellation& cancellation) {
  constexpr std::chrono::milliseconds kLook(50);
  while (!cancellation.requested()) std::this_thread::sleep_for(kLook);
}

/// What of a replay somebody who looks at it should know.
std::vector<std::string> remarks_of(const ReplaySummary& summary) {
  std::vector<std::string> remarks;
  if (!summary.loss.empty()) remarks.push_back(summary.loss);
  if (summary.refused > 0)
    remarks.push_back(counted(summary.refused, "message") + " refused, the first: " + summary.first_refusal);
  if (summary.different > 0)
    remarks.push_back(counted(summary.different, "step") + " of " + std::to_string(summary.compared) +
                      " differ from the recorded ones");
  if (!summary.began_anew.empty()) remarks.push_back(summary.began_anew);
  for (const auto& [what, steps] : summary.degraded) remarks.push_back(counted(steps, "step") + ": " + what);
  return remarks;
}

void print_ready(const std::string& url, int port, const std::string& what, VerbContext& context) {
  context.print({{"url", url}, {"port", port}, {"showing", what}, {"state", "ready"}},
                "open " + url + " in a browser; Ctrl-C ends\n");
}

core::Status view_recording(ViewVerbOptions& options, VerbContext& context) {
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open({options.recording, options.scene, options.depth_scale,
                                                           options.frame_rate, options.read},
                                                          context.log()));
  tell_what_goes_on(input, context);
  PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *input.scene()));
  TrackerSettings settings = options.tracker;
  if (input.has_settings()) {
    PRESCENE_TRY(TrackerSettings recorded, input.recorded_settings());
    settings = with_given(*options.verb, std::move(recorded), options.tracker);
  }
  settings.assembler.robot = input.robot();
  Backends backends(context.pool(), options.backends);
  const std::uint64_t seed =
      context.options().seed_given ? context.options().seed : input.seed_or(context.options().seed);
  PRESCENE_TRY(const auto tracker, Tracker::create(input.scene(), settings, seed, backends));
  RecordingViewOptions view_options;
  view_options.view = options.view;
  view_options.title = std::filesystem::path(options.recording).filename().string();
  PRESCENE_TRY(const auto view, RecordingView::create(input.scene(), view_options, backends, context.log()));
  print_ready(view->url(), view->port(), options.recording, context);
  const core::ProgressSink bar = context.progress("replaying");
  const core::ProgressSink progress = [&](const core::Progress& at) {
    view->set_progress(at.fraction);
    if (bar) bar(at);
  };
  const core::Result<ReplaySummary> summary =
      input.replay(*tracker, context.cancellation(), progress, view->step_sink(), {});
  context.end_progress();
  if (!summary) return summary.status();
  if (summary->cancelled) return core::ok_status();
  PRESCENE_RETURN_IF_ERROR(check_steps(*summary, first_topics(settings, *input.scene())).at(options.recording));
  view->finish(remarks_of(*summary));
  core::log(context.log(), core::LogLevel::kInfo, counted(summary->steps, "step") + " to be looked at");
  wait_for_stop(context.cancellation());
  return core::ok_status();
}

core::Status view_bus(ViewVerbOptions& options, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(take_domain(*options.verb, options.dds));
  std::shared_ptr<const belief::Scene> scene;
  if (!options.scene.empty()) {
    PRESCENE_TRY(const std::string text, read_scene_text(options.scene));
    PRESCENE_TRY(scene, load_scene_text(text, options.scene, context.log()));
    PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *scene));
    PRESCENE_TRY(options.tracker.assembler.robot, load_robot(text, options.scene));
  }
  PRESCENE_TRY(const auto view, BusView::create(scene, {options.dds, options.tracker, options.view}, context.log()));
  print_ready(view->url(), view->port(), "DDS domain " + std::to_string(options.dds.domain), context);
  view->run(context.cancellation());
  return core::ok_status();
}

/// kInvalidInput for an option that would do nothing.
core::Status check_options(const ViewVerbOptions& options) {
  const auto given = [&options](const char* name) { return options.verb->count(name) > 0; };
  if (options.recording.empty()) {
    for (const char* name :
         {"--depth-scale", "--frame-rate", "--salvage", "--all-parts", "--likelihood", "--graphics-device"})
      if (given(name)) return core::invalid_input(std::string(name) + " is for recordings: leave it out, or name one");
    return core::ok_status();
  }
  for (const char* name : kDomainOptions)
    if (given(name))
      return core::invalid_input(std::string(name) +
                                 " is for what is on the bus, and a recording needs none of it: "
                                 "leave it out");
  return check_folder_options(*options.verb, options.recording);
}

}  // namespace

Verb add_view_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("view", "Show a recording, or a running `serve`, in the browser");
  auto options = std::make_shared<ViewVerbOptions>();
  verb->add_option("RECORDING", options->recording,
                   "MCAP or .db3 file, folder of rosbag2, or folder with frames/, intrinsics.K.txt and "
                   "camera_poses.csv; default: "
                   "what is on the bus")
      ->check(file_name());
  verb->add_option("--port", options->view.port, "Port of the page; 0 = any that is free")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  verb->add_option(
          "--scene", options->scene,
          "Scene file; default: the one that the recording holds; a folder without one is searched for its support; of "
          "what is on the bus, only what its markers show is drawn")
      ->check(file_name());
  add_input_options(*verb, options->depth_scale, options->frame_rate, options->read);
  add_web_options(*verb, "", options->view);
  add_bus_options(*verb, options->dds, options->tracker);
  add_camera_options(*verb, options->tracker.assembler);
  add_likelihood_options(*verb, options->backends.likelihood);
  options->verb = verb;
  verb->footer(
      "Examples: prescene view milk.mcap\n"
      "          prescene view --scene scenarios/milk_on_bin.yaml");
  return {verb, [options](VerbContext& context) -> core::Status {
            PRESCENE_RETURN_IF_ERROR(check_options(*options));
            PRESCENE_RETURN_IF_ERROR(validate(options->tracker.topics));
            return options->recording.empty() ? view_bus(*options, context) : view_recording(*options, context);
          }};
}

}  // namespace prescene::service
