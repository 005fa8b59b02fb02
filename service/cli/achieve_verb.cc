// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "achieve_options.h"
#include "output_files.h"
#include "prescene/belief/json.h"
#include "prescene/interfaces/images/png.h"
#include "prescene/interfaces/reports/action_map_picture.h"
#include "prescene/interfaces/reports/report.h"
#include "prescene/service/backends.h"
#include "prescene/service/load_scene.h"
#include "verb.h"

namespace prescene::service {
namespace {

struct AchieveVerbOptions {
  std::string scene, map, report;
  AchieveOptions question;
};

core::Status run(const AchieveVerbOptions& options, VerbContext& context) {
  PRESCENE_RETURN_IF_ERROR(check_png("--map", options.map));
  PRESCENE_RETURN_IF_ERROR(check_output("--map", options.map, {options.scene}));
  PRESCENE_RETURN_IF_ERROR(check_output("--report", options.report, {options.scene}));
  PRESCENE_RETURN_IF_ERROR(check_apart("--map", options.map, "--report", options.report));
  PRESCENE_TRY(const nlohmann::ordered_json question, achieve_question(options.question));
  PRESCENE_TRY(const belief::Query query, belief::query_from_json(belief::json_text(question)));
  PRESCENE_TRY(const auto scene, load_scene(options.scene, context.log()));
  Backends backends(context.pool());
  queries::QueryContext query_context = backends.query_context(context.pool());
  query_context.cancellation = &context.cancellation();
  query_context.progress = context.progress("searching");
  const belief::Answer answer = queries::answer(scene, context.options().seed, query, query_context);
  context.end_progress();
  PRESCENE_RETURN_IF_ERROR(answer.error.at(options.scene));

  const auto& achieved = std::get<belief::AchieveAnswer>(answer.what);
  if (!options.map.empty()) {
    const geometry::ColorImage picture = interfaces::action_map_picture(achieved);
    if (picture.empty()) {
      core::log(context.log(), core::LogLevel::kWarning,
                "no map was drawn: there is one only of two free parameters or more, where a choice was certified");
    } else {
      PRESCENE_RETURN_IF_ERROR(interfaces::write_png(options.map, picture.view()));
      core::log(context.log(), core::LogLevel::kInfo, "map written to " + options.map);
    }
  }
  if (!options.report.empty()) {
    interfaces::ReportContents contents;
    contents.title = scene->name;
    contents.subtitle = "How it is to be done";
    contents.facts = {{"scene file", options.scene}, {"seed", std::to_string(context.options().seed)}};
    contents.sections = interfaces::answer_sections(answer, *scene);
    PRESCENE_RETURN_IF_ERROR(interfaces::write_report(options.report, contents));
    core::log(context.log(), core::LogLevel::kInfo, "report written to " + options.report);
  }
  nlohmann::ordered_json document = {{"scene", scene->name}, {"seed", context.options().seed}};
  const nlohmann::ordered_json answered = belief::to_json(answer).at("achieve");
  document.update(answered);
  context.print(document, achieve_text(answered));
  if (context.cancellation().requested()) return core::cancelled("stopped on request; what was done is printed");
  return core::ok_status();
}

}  // namespace

Verb add_achieve_verb(CLI::App& app) {
  auto* verb = app.add_subcommand("achieve", "How must an action be done, so that an outcome comes about?");
  auto options = std::make_shared<AchieveVerbOptions>();
  verb->add_option("SCENE", options->scene, "Scene file (docs/reference/scene_files.md)")->required();
  verb->add_option("--outcome", options->question.outcome,
                   "One of the scene's outcomes, or one of an exclusive group, as in_bin or where.in_bin")
      ->required()
      ->check(utf8_text());
  add_achieve_options(*verb, options->question);
  verb->add_option("--map", options->map, "Write a PNG picture of the map over the two parameters that decide most")
      ->check(file_name());
  verb->add_option("--report", options->report, "Write an HTML page with map, tables and profiles")->check(file_name());
  verb->footer(
      "Example: prescene achieve scenarios/milk_on_bin.yaml --outcome in_bin --free "
      "position,pitch=-120:0,height=0:0.3");
  return {verb, [options](VerbContext& context) { return run(*options, context); }};
}

}  // namespace prescene::service
