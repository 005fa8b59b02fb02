// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "prescene/core/text.h"
#include "prescene/service/recording/explained.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct ExplainVerbOptions {
  std::string input;
  std::string scene;
  ExplainOptions explain;
  TrackerSettings tracker;
  BackendSettings backends;
  double depth_scale = 0.001;
  double frame_rate = 30.0;
  const CLI::App* verb = nullptr;
};

std::string interval_text(const std::optional<queries::EventValue>& value, int decimals, double shift = 0.0) {
  if (!value) return "";
  return fixed_text(value->mean + shift, decimals) + " (" + fixed_text(value->low + shift, decimals) + " to " +
         fixed_text(value->high + shift, decimals) + ")";
}

/// Their times count from the recording's first frame, those of the answer from the window's begin.
std::string explanation_text(const Explained& explained) {
  const queries::ExplainAnswer& answer = explained.answer;
  std::vector<std::vector<std::string>> rows = {{"event", "object", "probability, %", "interval, %", "log Bayes factor",
                                                 "time, s", "towards, deg", "speed, m/s", "tips, %", "falls, %"}};
  for (const queries::Explanation& e : answer.explanations) {
    if (e.probability < 0.0005 && rows.size() > 3) continue;
    const bool with_effects = e.time.has_value();
    rows.push_back(
        {belief::name_of(e.kind), e.object + (e.partner.empty() ? "" : ", " + e.partner),
         fixed_text(100.0 * e.probability, 1), fixed_text(100.0 * e.low, 1) + " to " + fixed_text(100.0 * e.high, 1),
         fixed_text(e.log_bayes_factor, 1), interval_text(e.time, 2, explained.from), interval_text(e.towards, 0),
         interval_text(e.speed, 2), with_effects ? fixed_text(100.0 * e.tips, 0) : "",
         with_effects ? fixed_text(100.0 * e.falls, 0) : ""});
  }
  std::string text = answer.text + "\n\n" + table(rows);
  std::vector<std::vector<std::string>> places = {{"object", "there, %", "at the end, m", "90 % within, cm", ""}};
  for (const queries::WhereItIs& object : answer.objects)
    places.push_back(
        {object.object, fixed_text(100.0 * object.present, 0),
         fixed_text(object.mean.x(), 3) + ", " + fixed_text(object.mean.y(), 3) + ", " + fixed_text(object.mean.z(), 3),
         fixed_text(100.0 * object.radius_90, 1), object.out_of_sight ? "out of sight" : ""});
  text += "\n" + table(places);
  std::vector<std::vector<std::string>> frames = {{"frame, s", "against nothing, nats", "against the second, nats"}};
  for (const queries::DecidingFrame& frame : answer.frames)
    frames.push_back({fixed_text(frame.time + explained.from, 2), fixed_text(frame.against_nothing, 1),
                      fixed_text(frame.against_second, 1)});
  text += "\n" + table(frames);
  for (const std::string& remark : answer.remarks) text += remark + "\n";
  for (const std::string& remark : explained.remarks) text += remark + "\n";
  return text + std::to_string(answer.evaluated) + " instances weighed, " + std::to_string(answer.simulated) +
         " simulated, in " + fixed_text(explained.seconds, 1) + " s\n";
}

core::Status run(ExplainVerbOptions& options, VerbContext& context) {
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open({options.input, options.scene, options.depth_scale,
                                                           options.frame_rate, options.explain.read},
                                                          context.log()));
  TrackerSettings settings = options.tracker;
  if (input.has_settings()) {
    PRESCENE_TRY(TrackerSettings recorded, input.recorded_settings());
    settings = with_given(*options.verb, std::move(recorded), options.tracker);
  }
  options.explain.path = options.input;
  options.explain.query.seed = context.options().seed;
  Backends backends(context.pool(), options.backends);
  const std::uint64_t seed =
      context.options().seed_given ? context.options().seed : input.seed_or(context.options().seed);
  const auto explained = explain_recording(input, options.explain, settings, seed, backends, context.cancellation(),
                                           context.progress("tracking"));
  context.end_progress();
  if (!explained) return explained.status();
  nlohmann::ordered_json document = {{"recording", options.input}, {"seed", options.explain.query.seed}};
  document.update(to_json(*explained));
  context.print(document, explanation_text(*explained));
  return core::ok_status();
}

}  // namespace

Verb add_explain_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("explain",
                                  "Explain what a recording shows in a window of time: which event, when, where from");
  auto options = std::make_shared<ExplainVerbOptions>();
  verb->add_option("RECORDING", options->input, "MCAP or .db3 file, folder of rosbag2, or of images as for replay")
      ->required();
  verb->add_option("--from", options->explain.from, "Begin of the window, s since the first frame")
      ->check(number_between(0.0, 1e6))
      ->required();
  verb->add_option("--to", options->explain.to, "End of the window, s since the first frame")
      ->check(number_between(0.0, 1e6))
      ->required();
  verb->add_option("--object", options->explain.query.object,
                   "Events of this object only; default: of every object that is not where it would be")
      ->check(utf8_text());
  verb->add_option("--scene", options->scene, "Scene file; default: the one that the recording holds")
      ->check(file_name());
  verb->add_option("--frames", options->explain.query.frames, "Frames of the window that weigh the events")
      ->check(CLI::Range(2, 64))
      ->capture_default_str();
  verb->add_option("--runs", options->explain.query.runs,
                   "Independent searches of each event that competes, and more where its interval is wide")
      ->check(CLI::Range(2, 64))
      ->capture_default_str();
  verb->add_option("--points", options->explain.query.points, "Instances of each search")
      ->check(CLI::Range(8, 4096))
      ->capture_default_str();
  verb->add_option("--half-width", options->explain.query.half_width,
                   "Of the probabilities' intervals: good enough to stop searching")
      ->check(number_between(0.001, 0.5))
      ->capture_default_str();
  add_input_options(*verb, options->depth_scale, options->frame_rate, options->explain.read.salvage);
  add_topic_options(*verb, options->tracker);
  add_camera_options(*verb, options->tracker.assembler);
  add_likelihood_options(*verb, options->backends.likelihood);
  options->verb = verb;
  verb->footer("Example: prescene explain milk.mcap --from 2.0 --to 4.0 --object carton");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
