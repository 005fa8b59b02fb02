// SPDX-License-Identifier: Apache-2.0
// The page of `prescene evaluate FOLDER --report FILE`.
#pragma once

#include <vector>

#include "prescene/interfaces/reports/report.h"
#include "prescene/service/calibration/toss_evaluation.h"

namespace prescene::service {

/// Scores with their errors, whether probabilities came true as often as they say, how many ends the regions hold, how
/// far ends are from where they were forecast, each part's fit and each toss.
std::vector<interfaces::ReportSection> evaluation_sections(const TossEvaluation& evaluation);

}  // namespace prescene::service
