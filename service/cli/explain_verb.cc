// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <utility>

#include "prescene/core/text.h"
#include "prescene/interfaces/reports/report.h"
#include "prescene/service/recording/explained.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

struct ExplainVerbOptions {
  std::string input;
  std::string scene;
  std::string report;
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

using Rows = std::vector<std::vector<std::string>>;

/// What an explanation is printed as, each with a head. Times count from the recording's first frame, those of the
/// answer from the window's start.
struct ExplanationTables {
  Rows events, places, frames;
};

ExplanationTables tables_of(const Explained& explained) {
  const queries::ExplainAnswer& answer = explained.answer;
  ExplanationTables tables;
  tables.events = {{"event", "object", "probability, %", "interval, %", "log Bayes factor", "time, s", "towards, deg",
                    "speed, m/s", "tips, %", "falls, %"}};
  for (const queries::Explanation& e : answer.explanations) {
    if (e.probability < 0.0005 && tables.events.size() > 3) continue;
    const bool with_effects = e.time.has_value();
    tables.events.push_back(
        {belief::name_of(e.kind), e.object + (e.partner.empty() ? "" : ", " + e.partner),
         fixed_text(100.0 * e.probability, 1), fixed_text(100.0 * e.low, 1) + " to " + fixed_text(100.0 * e.high, 1),
         fixed_text(e.log_bayes_factor, 1), interval_text(e.time, 2, explained.from), interval_text(e.towards, 0),
         interval_text(e.speed, 2), with_effects ? fixed_text(100.0 * e.tips, 0) : "",
         with_effects ? fixed_text(100.0 * e.falls, 0) : ""});
  }
  tables.places = {{"object", "there, %", "at the end, m", "90 % within, cm", ""}};
  for (const queries::WhereItIs& object : answer.objects)
    tables.places.push_back(
        {object.object, fixed_text(100.0 * object.present, 0),
         fixed_text(object.mean.x(), 3) + ", " + fixed_text(object.mean.y(), 3) + ", " + fixed_text(object.mean.z(), 3),
         fixed_text(100.0 * object.radius_90, 1), object.out_of_sight ? "out of sight" : ""});
  // Against itself, that nothing happened is worth 0 in every frame.
  const bool something =
      !answer.explanations.empty() && answer.explanations.front().kind != belief::EventKind::kNothing;
  tables.frames = {{"frame, s", "against the second, nats"}};
  if (something) tables.frames.front().insert(tables.frames.front().begin() + 1, "against nothing, nats");
  for (const queries::DecidingFrame& frame : answer.frames) {
    std::vector<std::string>& row = tables.frames.emplace_back();
    row.push_back(fixed_text(frame.time + explained.from, 2));
    if (something) row.push_back(fixed_text(frame.against_nothing, 1));
    row.push_back(fixed_text(frame.against_second, 1));
  }
  return tables;
}

std::vector<std::string> remarks_of(const Explained& explained) {
  std::vector<std::string> remarks = explained.answer.remarks;
  remarks.insert(remarks.end(), explained.remarks.begin(), explained.remarks.end());
  return remarks;
}

std::string work_text(const Explained& explained) {
  return std::to_string(explained.answer.evaluated) + " instances weighed, " +
         std::to_string(explained.answer.simulated) + " simulated, in " + fixed_text(explained.seconds, 1) + " s";
}

std::string explanation_text(const Explained& explained) {
  const ExplanationTables tables = tables_of(explained);
  std::string text = explained.answer.text + "\n";
  for (const Rows* rows : {&tables.events, &tables.places, &tables.frames}) text += "\n" + table(*rows);
  for (const std::string& remark : remarks_of(explained)) text += remark + "\n";
  return text + work_text(explained) + "\n";
}

interfaces::TableBlock table_block(const std::string& caption, Rows rows) {
  std::vector<std::string> columns = std::move(rows.front());
  rows.erase(rows.begin());
  return {caption, std::move(columns), std::move(rows)};
}

core::Status write_explanation_report(const std::string& path, const std::string& recording,
                                      const Explained& explained) {
  ExplanationTables tables = tables_of(explained);
  interfaces::ReportContents contents;
  contents.title = "What happened";
  contents.subtitle = explained.answer.text;
  contents.facts = {{"recording", recording},
                    {"window", fixed_text(explained.from, 2) + " to " + fixed_text(explained.to, 2) + " s"},
                    {"work", work_text(explained)}};
  interfaces::ReportSection& events = contents.sections.emplace_back();
  events.title = "Events";
  interfaces::OutcomeBlock bars{"probabilities with their intervals", {}};
  for (const queries::Explanation& e : explained.answer.explanations) {
    if (e.probability < 0.0005 && bars.outcomes.size() > 2) continue;
    const std::string name = belief::name_of(e.kind) + (e.object.empty() ? "" : " (" + e.object + ")");
    bars.outcomes.push_back({name, "", e.probability, e.low, e.high});
  }
  events.blocks.emplace_back(std::move(bars));
  events.blocks.emplace_back(
      table_block("when, from where, how hard; means with 90 % intervals", std::move(tables.events)));
  if (!explained.answer.explanations.empty() && !explained.answer.explanations.front().timeline.empty())
    events.blocks.emplace_back(interfaces::TimelineBlock{"the most probable instance, s from the window's start",
                                                         explained.answer.explanations.front().timeline, 0.0,
                                                         explained.answer.duration});
  interfaces::ReportSection& end = contents.sections.emplace_back();
  end.title = "Where things are at the end, and what decides";
  end.blocks.emplace_back(table_block("over all events", std::move(tables.places)));
  end.blocks.emplace_back(table_block("how much each frame speaks for the first event (tempered log likelihoods)",
                                      std::move(tables.frames)));
  std::string remarks;
  for (const std::string& remark : remarks_of(explained)) remarks += (remarks.empty() ? "" : "\n\n") + remark;
  if (!remarks.empty()) end.blocks.emplace_back(interfaces::TextBlock{remarks});
  return interfaces::write_report(path, contents);
}

core::Status run(ExplainVerbOptions& options, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(check_folder_options(*options.verb, options.input));
  PRESCENE_RETURN_IF_ERROR(check_output("--report", options.report, {options.input, options.scene}));
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open({options.input, options.scene, options.depth_scale,
                                                           options.frame_rate, options.explain.read},
                                                          context.log()));
  TrackerSettings settings = options.tracker;
  if (input.has_settings()) {
    PRESCENE_TRY(TrackerSettings recorded, input.recorded_settings());
    settings = with_given(*options.verb, std::move(recorded), options.tracker);
  }
  settings.assembler.robot = input.robot();
  options.explain.path = options.input;
  options.explain.query.seed = context.options().seed;
  Backends backends(context.pool(), options.backends);
  const std::uint64_t seed =
      context.options().seed_given ? context.options().seed : input.seed_or(context.options().seed);
  const auto explained = explain_recording(input, options.explain, settings, seed, backends, context.cancellation(),
                                           context.progress("tracking"));
  context.end_progress();
  if (!explained) return explained.status();
  if (!options.report.empty()) {
    PRESCENE_RETURN_IF_ERROR(write_explanation_report(options.report, options.input, *explained));
    core::log(context.log(), core::LogLevel::kInfo, "report written to " + options.report);
  }
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
  verb->add_option("--from", options->explain.from, "Start of the window, s since the first frame")
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
  verb->add_option("--report", options->report, "Write an HTML page with probabilities, tables and a timeline")
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
