// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "output_files.h"
#include "prescene/core/text.h"
#include "replay_options.h"

namespace prescene::service {
namespace {

/// kInvalidInput for an option that would do nothing.
core::Status check_options(const ReplayOptions& options) {
  const auto given = [&options](const char* name) { return options.verb->count(name) > 0; };
  if (options.over_dds && given("--proposals"))
    return core::invalid_input("--proposals is for replaying here: give it to the running `serve` instead");
  if (!options.over_dds) {
    for (const char* name : kDomainOptions)
      if (given(name))
        return core::invalid_input(std::string(name) + " is for --over-dds: leave it out, or give that too");
  } else {
    for (const char* name : {"--timeline", "--interval", "--other", "--relation"})
      if (given(name))
        return core::invalid_input(std::string(name) +
                                   " goes without --over-dds: with it, ask the `serve` that tracks");
    for (const char* name : {"--learned", "--new-objects"})
      if (given(name))
        return core::invalid_input(std::string(name) + " goes without --over-dds: give it to the `serve` that tracks");
  }
  if (!(options.read.from < options.read.to))
    return core::invalid_input("--from " + core::rounded_text(options.read.from) + " is not before --to " +
                               core::rounded_text(options.read.to) +
                               (options.read.from > options.read.to ? ": exchange them" : ": give a later --to"));
  if (!interfaces::is_bag(options.input)) {
    for (const char* name : {"--from", "--to", "--all-parts"})
      if (given(name)) return core::invalid_input(std::string(name) + " is for recordings: leave it out");
    return core::ok_status();
  }
  return check_folder_options(*options.verb, options.input);
}

}  // namespace

ReplayInputOptions replay_input_of(const ReplayOptions& options) {
  return {options.input, options.scene, options.depth_scale, options.frame_rate, options.read, Symmetries::kSuggested};
}

core::Result<TrackerSettings> replay_settings_of(const ReplayOptions& options, const ReplayInput& input) {
  PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *input.scene()));
  if (!input.has_settings()) return options.tracker;
  PRESCENE_TRY(TrackerSettings recorded, input.recorded_settings());
  return with_given(*options.verb, std::move(recorded), options.tracker);
}

void warn_of_unchecked(const ReplayOptions& options, const std::string& unchecked, VerbContext& context) {
  if (!unchecked.empty()) core::log(context.log(), core::LogLevel::kInfo, options.input + ": " + unchecked);
}

core::Status check_files_are_there(const ReplayOptions& options, const std::string& missing) {
  if (missing.empty() || options.read.salvage) return core::ok_status();
  return core::data_loss(options.input + ": " + missing + "; --salvage takes what is there");
}

Verb add_replay_verb(CLI::App& app) {
  auto* verb = app.add_subcommand(
      "replay", "Replay a recording or a folder of images: here, or onto the bus for a running `serve`");
  auto options = std::make_shared<ReplayOptions>();
  verb->add_option(
          "RECORDING", options->input,
          "MCAP or .db3 file, folder of rosbag2, or folder with frames/, intrinsics.K.txt and camera_poses.csv")
      ->required();
  verb->add_option(
          "--scene", options->scene,
          "Scene file; default: the one that the recording holds; a folder without one is searched for its support")
      ->check(file_name());
  verb->add_flag("--over-dds", options->over_dds,
                 "Publish the robot's messages as they were, and listen to a running `serve`");
  verb->add_option("--speed", options->bus.speed, "Over DDS: times as fast as recorded")
      ->check(in_range(kReplaySpeeds))
      ->needs("--over-dds")
      ->capture_default_str();
  verb->add_option("--ask", options->questions, "Over DDS: SECONDS:JSON, a question to ask at that time; repeatable")
      ->needs("--over-dds");
  verb->add_flag("--loop", options->bus.loop,
                 "Over DDS: play it again and again from the start, with the same stamps, until Ctrl-C")
      ->needs("--over-dds")
      ->excludes("--ask");
  add_input_options(*verb, options->depth_scale, options->frame_rate, options->read);
  verb->add_option("--from", options->read.from,
                   "Begin so many seconds after the recording's first message: the belief begins anew there")
      ->check(number_between(0.0, 1e9))
      ->capture_default_str();
  verb->add_option("--to", options->read.to, "End so many seconds after the recording's first message")
      ->check(number_between(0.0, 1e9));
  verb->add_option("--report", options->report, "Write an HTML page with pictures, tables and timelines")
      ->check(file_name())
      ->excludes("--loop");
  verb->add_option("--timeline", options->timeline_file,
                   "Write when which relations held (on, in, touches, moves, falls, ...) as JSON")
      ->check(file_name());
  add_timeline_options(*verb, options->timeline);
  add_proposals_option(*verb, options->proposals);
  add_bus_options(*verb, options->bus.dds, options->tracker);
  add_camera_options(*verb, options->tracker.assembler);
  add_belief_options(*verb, options->tracker, options->learned);
  add_likelihood_options(*verb, options->backends.likelihood);
  options->verb = verb;
  verb->footer(
      "Examples: prescene replay milk.mcap --report milk.html\n"
      "          prescene replay bag_folder --scene table.yaml --from 12 --to 20\n"
      "          prescene replay milk.mcap --over-dds --ask '2.4:{\"predict\": {}}'");
  return {
      verb, [options](VerbContext& context) -> core::Status {
        PRESCENE_RETURN_IF_ERROR(check_options(*options));
        if (options->over_dds) PRESCENE_RETURN_IF_ERROR(take_domain(*options->verb, options->bus.dds));
        PRESCENE_RETURN_IF_ERROR(check_output("--report", options->report, {options->input, options->scene}));
        PRESCENE_RETURN_IF_ERROR(check_output("--timeline", options->timeline_file, {options->input, options->scene}));
        PRESCENE_RETURN_IF_ERROR(check_apart("--learned", options->learned, "--report", options->report));
        for (const auto& [name, file] :
             {std::pair("--learned", options->learned), std::pair("--report", options->report)})
          PRESCENE_RETURN_IF_ERROR(check_apart("--timeline", options->timeline_file, name, file));
        PRESCENE_RETURN_IF_ERROR(timeline_question(options->timeline).status());
        PRESCENE_RETURN_IF_ERROR(take_learned(options->learned, {options->input, options->scene}, options->tracker));
        PRESCENE_RETURN_IF_ERROR(validate(options->tracker.topics));
        return options->over_dds ? replay_over_dds(*options, context) : replay_here(*options, context);
      }};
}

}  // namespace prescene::service
