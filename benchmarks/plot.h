// SPDX-License-Identifier: Apache-2.0
// Line charts with a logarithmic scale, as SVG.
#pragma once

#include <string>
#include <vector>

namespace prescene::benchmarks {

struct Series {
  std::string name;
  std::vector<double> values;  ///< One for each place of the chart; NaN where there is none, else positive.
  bool dashed = false;
};

struct Plot {
  std::string name;  ///< Lower case, for file names.
  std::string title;
  std::string y_label;
  std::vector<std::string> x_labels;
  std::vector<Series> series;
};

/// A complete SVG document; a plot without values says so.
std::string svg_of(const Plot& plot);

}  // namespace prescene::benchmarks
