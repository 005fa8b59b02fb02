// SPDX-License-Identifier: Apache-2.0
// A prediction as sections of a report, and how positions are written.
#pragma once

#include <string>
#include <vector>

#include "prescene/interfaces/reports/report.h"

namespace prescene::interfaces {

std::vector<ReportSection> prediction_sections(const belief::PredictAnswer& answer, const belief::Scene& scene);

std::string in_millimetres(double metres);
std::string in_degrees(double radians);
std::string position_text(const geometry::Vector3d& p);

}  // namespace prescene::interfaces
