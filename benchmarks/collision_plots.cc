// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/collision_plots.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <variant>

#include "benchmarks/collision_algorithms.h"
#include "benchmarks/collision_tables.h"

namespace prescene::benchmarks {
namespace {

using collision::Builder;
using collision::SimdopOptions;

Plot summary_plot(const Measurements& measurements) {
  std::vector<double> shares = shares_of(measurements);
  std::sort(shares.begin(), shares.end());
  Plot plot{"times", "Boolean queries: median time, geometric mean over pairs", "microseconds", {}, {}};
  for (const double share : shares) plot.x_labels.push_back(share_text(share));
  for (std::size_t k = 0; k < measurements.algorithms.size(); ++k) {
    Series series{measurements.algorithms[k], {}, !measurements.ours[k]};
    for (const double share : shares)
      series.values.push_back(typical_microseconds(measurements, k, Query::kCollide, share));
    plot.series.push_back(std::move(series));
  }
  return plot;
}

Plot ratio_plot(const Measurements& measurements) {
  Plot plot{"ratios", "Default tree: how many times faster than FCL", "ratio", {}, {}};
  const Table table = ratio_table(measurements);
  for (std::size_t column = 2; column < table.columns.size(); ++column)
    plot.series.push_back({table.columns[column], {}, false});
  for (const std::vector<Figure>& row : table.rows) {
    if (std::get<std::string>(row[1]) != kDefaultTree) continue;
    plot.x_labels.push_back(std::get<std::string>(row[0]));
    for (std::size_t column = 2; column < row.size(); ++column)
      plot.series[column - 2].values.push_back(std::get<double>(row[column]));
  }
  return plot;
}

/// Times of the algorithms `names`, a place each: a line a distance.
Plot study_plot(const Measurements& study, Plot plot, const std::vector<std::string>& names, const std::string& prefix,
                bool dashed) {
  for (const double share : shares_of(study)) {
    Series series{prefix + share_text(share), {}, dashed};
    for (const std::string& name : names) {
      const auto found = std::find(study.algorithms.begin(), study.algorithms.end(), name);
      const auto index = static_cast<std::size_t>(found - study.algorithms.begin());
      series.values.push_back(found == study.algorithms.end()
                                  ? std::numeric_limits<double>::quiet_NaN()
                                  : typical_microseconds(study, index, Query::kCollide, share));
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

}  // namespace

std::vector<Plot> query_plots(const Measurements& measurements) {
  return {summary_plot(measurements), ratio_plot(measurements)};
}

std::vector<Plot> study_plots(const Measurements& study) {
  Plot by_k{"k", "SIMDop: median time over k", "microseconds", {}, {}};
  std::vector<std::string> names;
  for (const int k : collision::kDopSizes) {
    by_k.x_labels.push_back("k = " + std::to_string(k));
    names.push_back(simdop_name({.k = k}));
  }
  by_k = study_plot(study, std::move(by_k), names, "", false);

  Plot by_branching{"branching", "SIMDop: median time over children a node", "microseconds", {}, {}};
  names.clear();
  for (const int branching : {2, 4, 8, 16}) {
    by_branching.x_labels.push_back("n = " + std::to_string(branching));
    names.push_back(simdop_name({.branching = branching}));
  }
  by_branching = study_plot(study, std::move(by_branching), names, "", false);

  Plot by_builder{"builders", "Median time over builders", "microseconds", {}, {}};
  std::vector<std::string> simdops, defaults;
  for (const Builder builder : collision::kAllBuilders) {
    by_builder.x_labels.emplace_back(collision::to_string(builder));
    simdops.push_back(simdop_name({.builder = builder}));
    defaults.push_back(default_tree_name(builder));
  }
  by_builder = study_plot(study, std::move(by_builder), defaults, "default tree, ", false);
  by_builder = study_plot(study, std::move(by_builder), simdops, "SIMDop, ", true);
  return {std::move(by_k), std::move(by_branching), std::move(by_builder)};
}

}  // namespace prescene::benchmarks
