// SPDX-License-Identifier: Apache-2.0
// Answers to "how must it be done" as sections of a report.
#pragma once

#include <vector>

#include "prescene/interfaces/reports/report.h"

namespace prescene::interfaces {

std::vector<ReportSection> achieve_sections(const belief::AchieveAnswer& answer);

}  // namespace prescene::interfaces
