// SPDX-License-Identifier: Apache-2.0
// Drawings of a report as SVG elements, without captions. Well-formed XML; colours follow the page's style.
#pragma once

#include <string>

#include "prescene/interfaces/reports/report.h"

namespace prescene::interfaces {

/// A bar with its interval, filling its cell.
std::string probability_bar(const belief::OutcomeProbability& outcome);
std::string chart_svg(const ChartBlock& chart);
std::string tornado_svg(const TornadoBlock& block);
std::string timeline_svg(const TimelineBlock& block);
std::string state_band_svg(const StateBandBlock& block);
std::string heat_map_svg(const HeatMapBlock& block);

/// About `count` round numbers (1, 2 or 5 times a power of ten apart) within [low, high]; empty when that is no range.
std::vector<double> round_ticks(double low, double high, int count);

}  // namespace prescene::interfaces
