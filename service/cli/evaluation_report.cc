// SPDX-License-Identifier: Apache-2.0
#include "evaluation_report.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include "prescene/core/text.h"

namespace prescene::service {
namespace {

using core::fixed_text;
using interfaces::ChartBlock;
using interfaces::ReportSection;
using interfaces::TableBlock;
using interfaces::TextBlock;

constexpr double kQuantile95 = 1.96;

TableBlock block_of(TextTable table) {
  TableBlock block;
  block.columns = std::move(table.front());
  block.rows.assign(std::make_move_iterator(table.begin() + 1), std::make_move_iterator(table.end()));
  return block;
}

/// Of a share of n, after Wilson [Brown, Cai & DasGupta 2001].
std::pair<double, double> wilson_interval(double share, int n) {
  const double z2 = kQuantile95 * kQuantile95 / n;
  const double middle = (share + 0.5 * z2) / (1.0 + z2);
  const double half = kQuantile95 * std::sqrt((share * (1.0 - share) + 0.25 * z2) / n) / (1.0 + z2);
  return {std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

ReportSection score_section(const TossEvaluation& evaluation) {
  TableBlock table;
  table.columns = {"score", "value ± standard error"};
  table.rows = score_rows(evaluation.scores, " ± ");
  ReportSection section{"How well the tosses are forecast", {std::move(table)}};
  for (const std::string& remark : evaluation.remarks) section.blocks.push_back(TextBlock{remark});
  return section;
}

ReportSection reliability_section(const TossScores& scores) {
  ChartBlock sides;
  sides.caption =
      "Each of a thing's six sides has a probability of ending up. Of all that are about p, a share p should come "
      "true.";
  sides.x_label = "probability of a side";
  sides.y_label = "share that came true";
  ChartBlock::Curve found{.name = "found, with the 95 % interval of a share of n", .points = {}};
  for (const ReliabilityRow& row : scores.reliability) {
    found.points.emplace_back(row.mean, row.observed);
    found.band.push_back(wilson_interval(row.observed, std::max(1, row.n)));
  }
  sides.curves = {std::move(found), {.name = "as it should be", .points = {{0.0, 0.0}, {1.0, 1.0}}}};
  ChartBlock regions;
  regions.caption = "The densest region that a forecast gives a probability should hold the end as often.";
  regions.x_label = "probability of the region, %";
  regions.y_label = "ends that it holds, %";
  ChartBlock::Curve held{.name = "found, with two standard errors", .points = {}};
  ChartBlock::Curve wanted{.name = "as it should be", .points = {}};
  for (const CoverageValue& each : scores.coverage) {
    const double share = 100.0 * each.held.value, error = 200.0 * each.held.standard_error;
    held.points.emplace_back(100.0 * each.level, share);
    held.band.emplace_back(std::max(0.0, share - error), std::min(100.0, share + error));
    wanted.points.emplace_back(100.0 * each.level, 100.0 * each.level);
  }
  regions.curves = {std::move(held), std::move(wanted)};
  regions.from_zero = false;
  return {"Whether probabilities mean what they say",
          {std::move(sides), std::move(regions), block_of(reliability_table(scores))}};
}

ReportSection error_section(const std::vector<ScoredToss>& tosses) {
  std::vector<double> errors;
  for (const ScoredToss& toss : tosses) errors.push_back(1e3 * toss.error());
  std::sort(errors.begin(), errors.end());
  ChartBlock::Curve curve{.name = "tosses", .points = {{0.0, 0.0}}};
  for (std::size_t i = 0; i < errors.size(); ++i)
    curve.points.emplace_back(errors[i], 100.0 * static_cast<double>(i + 1) / static_cast<double>(errors.size()));
  ChartBlock chart;
  chart.caption = "How far things end from where they were forecast.";
  chart.x_label = "position error, mm";
  chart.y_label = "tosses with at most that, %";
  chart.curves = {std::move(curve)};
  return {"Where things end", {std::move(chart)}};
}

ReportSection fold_section(const std::vector<EvaluatedFold>& folds) {
  TableBlock table = block_of(fold_table(folds));
  table.caption = "Each part is forecast by the model that the others are fitted best by.";
  return {"The fits", {std::move(table)}};
}

}  // namespace

std::string with_error(const ScoreValue& score, double per_unit, int digits, const std::string& plus_minus) {
  return fixed_text(per_unit * score.value, digits) + plus_minus + fixed_text(per_unit * score.standard_error, digits);
}

TextTable score_rows(const TossScores& scores, const std::string& plus_minus) {
  const auto value = [&](const ScoreValue& score, double per_unit, int digits) {
    return with_error(score, per_unit, digits, plus_minus);
  };
  return {{"tosses", std::to_string(scores.n)},
          {"of them no twins", std::to_string(scores.independent)},
          {"right side up, %", value(scores.right_side, 100.0, 1)},
          {"Brier score of the side", value(scores.brier, 1.0, 3)},
          {"log score", value(scores.log_score, 1.0, 3)},
          {"median position error, mm", value(scores.median_error, 1e3, 1)},
          {"90 % position error, mm", value(scores.p90_error, 1e3, 1)},
          {"ends off by, x, mm", value(scores.mean_error[0], 1e3, 1)},
          {"ends off by, y, mm", value(scores.mean_error[1], 1e3, 1)}};
}

TextTable reliability_table(const TossScores& scores) {
  TextTable table = {{"probability of a side", "n", "mean", "came true"}};
  for (const ReliabilityRow& row : scores.reliability)
    table.push_back({fixed_text(row.low, 2) + " to " + fixed_text(row.high, 2), std::to_string(row.n),
                     fixed_text(row.mean, 3), fixed_text(row.observed, 3)});
  return table;
}

TextTable toss_table(const std::vector<ScoredToss>& tosses) {
  TextTable table = {{"toss", "side", "its probability", "Brier", "position error, mm", "in region of"}};
  for (const ScoredToss& toss : tosses)
    table.push_back({toss.name, kSides[toss.true_side], fixed_text(toss.side_probabilities[toss.true_side], 3),
                     fixed_text(toss.brier, 3), fixed_text(1e3 * toss.error(), 1),
                     fixed_text(100.0 * toss.region_mass, 1) + " %"});
  return table;
}

TextTable fold_table(const std::vector<EvaluatedFold>& folds) {
  TextTable table = {{"part", "fitted", "scored", "start noise, mm", "mrad", "scatter, %"}};
  for (const simulation::CalibratedParameter& p : folds.front().calibration.motion.parameters)
    table.front().push_back(to_string(p.parameter));
  for (std::size_t i = 0; i < folds.size(); ++i) {
    const simulation::ThrowScatter& throws = folds[i].calibration.throws;
    table.push_back({std::to_string(i + 1), std::to_string(folds[i].fitted), std::to_string(folds[i].scored),
                     fixed_text(1e3 * throws.position, 2), fixed_text(1e3 * throws.rotation, 1),
                     fixed_text(100.0 * throws.friction, 1)});
    for (const simulation::CalibratedParameter& p : folds[i].calibration.motion.parameters)
      table.back().push_back(fixed_text(p.value, 4));
  }
  return table;
}

std::vector<ReportSection> evaluation_sections(const TossEvaluation& evaluation) {
  std::vector<ReportSection> sections = {score_section(evaluation), reliability_section(evaluation.scores),
                                         error_section(evaluation.tosses)};
  if (!evaluation.folds.empty()) sections.push_back(fold_section(evaluation.folds));
  sections.push_back({"Each toss", {block_of(toss_table(evaluation.tosses))}});
  return sections;
}

}  // namespace prescene::service
