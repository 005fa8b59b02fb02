// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "explanation_text.h"
#include "output_files.h"
#include "prescene/belief/json.h"
#include "prescene/core/text.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/reports/report.h"
#include "prescene/service/pictures/explanation_strip.h"
#include "prescene/service/recording/explained.h"
#include "verb.h"

namespace prescene::service {
namespace {

using core::fixed_text;

constexpr std::size_t kStrips = 4;  // frames that are shown

struct ExplainVerbOptions {
  std::string input;
  std::string scene;
  std::string report;
  std::string pictures;
  std::string wanted;
  ExplainOptions explain;
  TrackerSettings tracker;
  BackendSettings backends;
  double depth_scale = 0.001;
  double frame_rate = 30.0;
  const CLI::App* verb = nullptr;
};

using Rows = std::vector<std::vector<std::string>>;

interfaces::TableBlock table_block(const std::string& caption, Rows rows) {
  std::vector<std::string> columns = std::move(rows.front());
  rows.erase(rows.begin());
  return {caption, std::move(columns), std::move(rows)};
}

core::Status write_explanation_report(const std::string& path, const std::string& recording, const Explained& explained,
                                      const nlohmann::ordered_json& document,
                                      const std::vector<ExplanationStrip>& strips) {
  ExplanationTables tables = explanation_tables(document);
  interfaces::ReportContents contents;
  contents.title = "What happened";
  contents.subtitle = explained.answer.text;
  contents.facts = {{"recording", recording},
                    {"window", fixed_text(explained.from, 2) + " to " + fixed_text(explained.to, 2) + " s"},
                    {"work", explanation_work_text(document)}};
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
  if (explained.answer.change) {
    interfaces::ReportSection& change = contents.sections.emplace_back();
    change.title = "What would have kept it";
    change.blocks.emplace_back(interfaces::TextBlock{explained.answer.change->sentence});
    interfaces::TableBlock parts{
        "the smallest change that was found", {"parameter", "from", "to", "unit", "deviations"}, {}};
    for (const queries::ChangedPart& part : explained.answer.change->parts)
      parts.rows.push_back(
          {part.name, fixed_text(part.from, 3), fixed_text(part.to, 3), part.unit, fixed_text(part.deviations, 2)});
    if (!parts.rows.empty()) change.blocks.emplace_back(std::move(parts));
  }
  if (!strips.empty()) {
    interfaces::ReportSection& seen = contents.sections.emplace_back();
    seen.title = "Seen, explained, and the difference";
    seen.blocks.emplace_back(interfaces::TextBlock{
        "The frames that decide most. Of the difference of depths, blue is nearer than the explanation has it, orange "
        "further, both from 5 cm on in full; grey is not known."});
    for (const ExplanationStrip& strip : strips)
      seen.blocks.emplace_back(interfaces::PictureBlock{
          {{fixed_text(strip.time + explained.from, 2) + " s, seen" +
                (strip.camera.empty() ? "" : " by camera " + strip.camera),
            strip.seen},
           {"explained; " + fixed_text(strip.against_nothing, 1) + " nats against nothing", strip.explained},
           {"difference", strip.difference}}});
  }
  interfaces::ReportSection& end = contents.sections.emplace_back();
  end.title = "Where things are at the end, and what decides";
  end.blocks.emplace_back(table_block("over all events", std::move(tables.places)));
  end.blocks.emplace_back(table_block("how much each frame speaks for the first event (tempered log likelihoods)",
                                      std::move(tables.frames)));
  std::string remarks;
  for (const std::string& remark : document.at("remarks").get<std::vector<std::string>>())
    remarks += (remarks.empty() ? "" : "\n\n") + remark;
  if (!remarks.empty()) end.blocks.emplace_back(interfaces::TextBlock{remarks});
  return interfaces::write_report(path, contents);
}

/// Before the work, so that a name that can't be a folder ends it at once.
core::Status make_pictures_folder(const std::string& folder) {
  if (folder.empty()) return core::ok_status();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    return core::unavailable("--pictures: the folder " + folder + " can't be made (" + error.message() +
                             "); name one that can be written");
  return core::ok_status();
}

/// A picture of each strip in the folder, named by its time, and by its camera if there are several:
/// explained_1.733_side.png.
core::Status write_strips(const std::string& folder, const std::vector<ExplanationStrip>& strips, double from) {
  for (const ExplanationStrip& strip : strips) {
    const geometry::ColorImage picture = side_by_side(strip);
    const std::string name =
        "explained_" + fixed_text(strip.time + from, 3) + (strip.camera.empty() ? "" : "_" + strip.camera) + ".png";
    PRESCENE_RETURN_IF_ERROR(interfaces::write_png(std::filesystem::path(folder) / name, picture.view()));
  }
  return core::ok_status();
}

/// "NAME", or an outcome as JSON.
core::Status take_wanted(const std::string& text, queries::ExplainQuery& query) {
  if (text.empty()) return core::ok_status();
  query.change = true;
  if (text.front() != '{') {
    query.wanted_name = text;
    return core::ok_status();
  }
  auto json = belief::parse_json(text);
  if (!json) return json.status().at("--wanted");
  if (!json->contains("name")) (*json)["name"] = "wanted";
  if (!json->contains("object") && !query.object.empty()) (*json)["object"] = query.object;
  auto outcome = belief::outcome_from_json(*json);
  if (!outcome) return outcome.status().at("--wanted");
  query.wanted = *std::move(outcome);
  return core::ok_status();
}

core::Status run(ExplainVerbOptions& options, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(take_wanted(options.wanted, options.explain.query));
  PRESCENE_RETURN_IF_ERROR(check_folder_options(*options.verb, options.input));
  PRESCENE_RETURN_IF_ERROR(check_output("--report", options.report, {options.input, options.scene}));
  PRESCENE_RETURN_IF_ERROR(make_pictures_folder(options.pictures));
  PRESCENE_TRY(const ReplayInput input, ReplayInput::open({options.input, options.scene, options.depth_scale,
                                                           options.frame_rate, options.explain.read},
                                                          context.log()));
  tell_what_goes_on(input, context);
  PRESCENE_RETURN_IF_ERROR(check_topics_once(*options.verb, *input.scene()));
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
  nlohmann::ordered_json document = {{"recording", options.input}, {"seed", options.explain.query.seed}};
  document.update(to_json(*explained));
  std::vector<ExplanationStrip> strips;
  if (!options.report.empty() || !options.pictures.empty()) {
    PRESCENE_TRY(strips, explanation_strips(explained->window, explained->answer, kStrips, backends));
  }
  if (!options.pictures.empty()) {
    PRESCENE_RETURN_IF_ERROR(write_strips(options.pictures, strips, explained->from));
    core::log(context.log(), core::LogLevel::kInfo,
              counted(strips.size(), "picture") + " written to " + options.pictures);
  }
  if (!options.report.empty()) {
    PRESCENE_RETURN_IF_ERROR(write_explanation_report(options.report, options.input, *explained, document, strips));
    core::log(context.log(), core::LogLevel::kInfo, "report written to " + options.report);
  }
  context.print(document, explanation_text(document));
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
  verb->add_option("--report", options->report,
                   "Write an HTML page with probabilities, tables, pictures and a timeline")
      ->check(file_name());
  verb->add_option("--pictures", options->pictures,
                   "Write pictures of the frames that decide into this folder: seen, explained, difference")
      ->check(file_name());
  verb->add_flag("--change", options->explain.query.change,
                 "Also the smallest change of the event or the start that would have kept the object as it was");
  verb->add_option("--wanted", options->wanted,
                   "The same, but for this outcome: a name of the scene's, or one as JSON with the keys of scene files")
      ->check(utf8_text());
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
  verb->add_option("--max-seconds", options->explain.max_seconds,
                   "Wall time, s, after which no search goes on; the answer then depends on the machine's speed, and "
                   "what there was no time for is said")
      ->check(number_between(0.0, 1e6));
  add_input_options(*verb, options->depth_scale, options->frame_rate, options->explain.read);
  add_topic_options(*verb, options->tracker);
  add_camera_options(*verb, options->tracker.assembler);
  add_likelihood_options(*verb, options->backends.likelihood);
  options->verb = verb;
  verb->footer("Example: prescene explain milk.mcap --from 2.0 --to 4.0 --object carton");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
