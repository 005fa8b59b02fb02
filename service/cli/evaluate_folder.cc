// SPDX-License-Identifier: Apache-2.0
#include "evaluate_folder.h"

#include <nlohmann/json.hpp>

#include "evaluation_report.h"
#include "prescene/core/text.h"
#include "prescene/service/calibration/toss_evaluation.h"

namespace prescene::service {
namespace {

std::string with_error(const ScoreValue& score, double unit, int digits) {
  return core::fixed_text(unit * score.value, digits) + " +- " + core::fixed_text(unit * score.standard_error, digits);
}

std::string scores_text(const TossScores& scores) {
  std::vector<std::vector<std::string>> rows = {{"", "value"},
                                                {"tosses", std::to_string(scores.n)},
                                                {"of them no twins", std::to_string(scores.independent)},
                                                {"right side up, %", with_error(scores.right_side, 100.0, 1)},
                                                {"Brier score of the side", with_error(scores.brier, 1.0, 3)},
                                                {"log score", with_error(scores.log_score, 1.0, 3)},
                                                {"median position error, mm", with_error(scores.median_error, 1e3, 1)},
                                                {"90 % position error, mm", with_error(scores.p90_error, 1e3, 1)},
                                                {"ends off by, x, mm", with_error(scores.mean_error[0], 1e3, 1)},
                                                {"ends off by, y, mm", with_error(scores.mean_error[1], 1e3, 1)}};
  for (const CoverageValue& each : scores.coverage)
    rows.push_back({"in " + core::fixed_text(100.0 * each.level, 0) + " % region, %", with_error(each.held, 100.0, 1)});
  std::vector<std::vector<std::string>> reliability = {{"probability of a side", "n", "mean", "came true"}};
  for (const ReliabilityRow& row : scores.reliability)
    reliability.push_back({core::fixed_text(row.low, 2) + " to " + core::fixed_text(row.high, 2), std::to_string(row.n),
                           core::fixed_text(row.mean, 3), core::fixed_text(row.observed, 3)});
  return table(rows) + "\n" + table(reliability);
}

std::string each_text(const std::vector<ScoredToss>& tosses) {
  std::vector<std::vector<std::string>> rows = {
      {"toss", "side", "its probability", "Brier", "position error, mm", "in region of"}};
  for (const ScoredToss& toss : tosses)
    rows.push_back({toss.name, kSides[toss.true_side], core::fixed_text(toss.side_probabilities[toss.true_side], 3),
                    core::fixed_text(toss.brier, 3), core::fixed_text(1e3 * toss.error(), 1),
                    core::fixed_text(100.0 * toss.region_mass, 1) + " %"});
  return table(rows) + "\n";
}

std::string folds_text(const std::vector<EvaluatedFold>& folds) {
  std::vector<std::vector<std::string>> rows = {{"part", "fitted", "scored", "start noise, mm", "mrad", "scatter, %"}};
  for (const simulation::CalibratedParameter& p : folds.front().calibration.motion.parameters)
    rows.front().push_back(to_string(p.parameter));
  for (std::size_t i = 0; i < folds.size(); ++i) {
    const simulation::ThrowScatter& throws = folds[i].calibration.throws;
    rows.push_back({std::to_string(i + 1), std::to_string(folds[i].fitted), std::to_string(folds[i].scored),
                    core::fixed_text(1e3 * throws.position, 2), core::fixed_text(1e3 * throws.rotation, 1),
                    core::fixed_text(100.0 * throws.friction, 1)});
    for (const simulation::CalibratedParameter& p : folds[i].calibration.motion.parameters)
      rows.back().push_back(core::fixed_text(p.value, 4));
  }
  return table(rows) + "\n";
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
  if (options.each) text += each_text(found->tosses);
  if (!found->folds.empty()) text += folds_text(found->folds);
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
