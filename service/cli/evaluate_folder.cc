// SPDX-License-Identifier: Apache-2.0
#include "evaluate_folder.h"

#include <nlohmann/json.hpp>

#include "evaluation_report.h"
#include "output_files.h"
#include "prescene/core/text.h"
#include "prescene/service/calibration/toss_evaluation.h"

namespace prescene::service {
namespace {

std::string scores_text(const TossScores& scores) {
  TextTable rows = score_rows(scores, " +- ");
  rows.insert(rows.begin(), {"", "value"});
  for (const CoverageValue& each : scores.coverage)
    rows.push_back(
        {"in " + core::fixed_text(100.0 * each.level, 0) + " % region, %", with_error(each.held, 100.0, 1, " +- ")});
  return table(rows) + "\n" + table(reliability_table(scores));
}

}  // namespace

core::Status evaluate_folder(const EvaluateFolderOptions& options, VerbContext& context) {
  if (options.folds && !options.model.empty())
    return core::invalid_input("--model and --folds exclude each other: each part is forecast with a model of its own");
  if (options.max_evaluations && !options.folds)
    return core::invalid_input("--max-evaluations goes with --folds: nothing else is fitted");
  std::vector<std::string> inputs = {options.folder + "/scene.yaml", options.folder + "/tosses.csv"};
  if (!options.model.empty()) inputs.push_back(options.model);
  PRESCENE_RETURN_IF_ERROR(check_output("--report", options.report, inputs));
  PRESCENE_TRY(const MotionDataset dataset, read_motion_dataset(options.folder, context.log()));
  BackendSettings settings;
  settings.stepper = Stepper::kAutomatic;
  Backends backends(context.pool(), settings);
  const core::ProgressSink progress = context.progress("evaluating " + options.folder);
  core::Result<TossEvaluation> found = core::cancelled("not begun");
  if (options.folds) {
    ObjectCalibrationOptions fit;
    fit.seed = context.options().seed;
    fit.max_evaluations = options.max_evaluations.value_or(fit.max_evaluations);
    found = evaluate_folds(dataset, *options.folds, backends, fit, progress, &context.cancellation());
  } else {
    found = evaluate_model(dataset, options.model, backends, context.options().seed, progress, &context.cancellation());
  }
  context.end_progress();
  if (!found) return found.status();
  nlohmann::ordered_json document;
  document["folder"] = options.folder;
  document["model"] = options.model;
  document["seed"] = context.options().seed;
  document.update(to_json(*found));
  std::string text;
  if (options.each) text += table(toss_table(found->tosses)) + "\n";
  if (!found->folds.empty()) text += table(fold_table(found->folds)) + "\n";
  text += scores_text(found->scores);
  if (!found->remarks.empty()) text += "\n";
  for (const std::string& remark : found->remarks) text += remark + "\n";
  context.print(document, text);
  if (!options.report.empty()) {
    interfaces::ReportContents contents;
    contents.title = options.folder;
    contents.subtitle = "Forecasts of recorded tosses against how they ended";
    const std::string model = options.folds ? "fitted to the others, " + std::to_string(*options.folds) + " parts"
                              : options.model.empty() ? std::string("the scene's own")
                                                      : options.model;
    contents.facts = {{"folder", options.folder}, {"model", model}, {"seed", std::to_string(context.options().seed)}};
    contents.sections = evaluation_sections(*found);
    PRESCENE_RETURN_IF_ERROR(interfaces::write_report(options.report, contents));
    core::log(context.log(), core::LogLevel::kInfo, "report written to " + options.report);
  }
  return core::ok_status();
}

}  // namespace prescene::service
