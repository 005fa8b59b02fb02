// SPDX-License-Identifier: Apache-2.0
// What `prescene evaluate FOLDER` shows: tables for its text and for the page of --report.
#pragma once

#include <string>
#include <vector>

#include "prescene/interfaces/reports/report.h"
#include "prescene/service/calibration/toss_evaluation.h"

namespace prescene::service {

/// The first row names the columns.
using TextTable = std::vector<std::vector<std::string>>;
/// Without names of columns: each score as "12.5 +- 0.9", with this between value and standard error.
TextTable score_rows(const TossScores& scores, const std::string& plus_minus);
/// "12.5 +- 0.9", in units of 1 / `per_unit`.
std::string with_error(const ScoreValue& score, double per_unit, int digits, const std::string& plus_minus);
TextTable reliability_table(const TossScores& scores);
TextTable toss_table(const std::vector<ScoredToss>& tosses);
/// At least one fold.
TextTable fold_table(const std::vector<EvaluatedFold>& folds);

/// Scores with their errors, whether probabilities came true as often as they say, how many ends the regions hold, how
/// far ends are from where they were forecast, each part's fit and each toss.
std::vector<interfaces::ReportSection> evaluation_sections(const TossEvaluation& evaluation);

}  // namespace prescene::service
