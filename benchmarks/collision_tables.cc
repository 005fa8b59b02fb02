// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/collision_tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "benchmarks/statistics.h"

namespace prescene::benchmarks {
namespace {

constexpr double kEmptyCell = std::numeric_limits<double>::quiet_NaN();

std::vector<double> measured(const std::vector<double>& values) {
  std::vector<double> kept;
  for (const double value : values)
    if (!std::isnan(value)) kept.push_back(value);
  return kept;
}

double mean_of(const std::vector<WorkCounts>& counts, double WorkCounts::*member) {
  if (counts.empty()) return kEmptyCell;
  double sum = 0.0;
  for (const WorkCounts& count : counts) sum += count.*member;
  return sum / static_cast<double>(counts.size());
}

std::string exact_text(float value) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.9g", static_cast<double>(value));
  return text.data();
}

void add_rows(const Cell& cell, const std::string& algorithm, const char* query, const std::vector<double>& seconds,
              const std::vector<WorkCounts>& counts, Table* table) {
  const std::vector<double> all = measured(seconds);
  if (all.empty()) return;
  for (const bool outliers : {true, false}) {
    const Summary s = summarize(outliers ? all : without_outliers(all));
    table->rows.push_back({cell.pair, cell.share, algorithm, query, outliers ? "kept" : "removed",
                           static_cast<std::int64_t>(s.n), 1e6 * s.mean, 1e6 * s.median, 1e6 * s.min, 1e6 * s.max,
                           1e6 * s.standard_deviation, 1e6 * s.median_absolute_deviation,
                           mean_of(counts, &WorkCounts::volume_tests), mean_of(counts, &WorkCounts::triangle_tests)});
  }
}

}  // namespace

std::vector<double> shares_of(const Measurements& measurements) {
  std::vector<double> shares;
  for (const Cell& cell : measurements.cells)
    if (std::find(shares.begin(), shares.end(), cell.share) == shares.end()) shares.push_back(cell.share);
  return shares;
}

std::string share_text(double share) {
  if (share == 0.0) return "touching";
  return (share < 0.0 ? "overlap " : "") + std::to_string(std::lround(100.0 * std::abs(share))) + " %";
}

Table query_table(const Measurements& measurements) {
  Table table{"queries",
              {"pair", "distance", "algorithm", "query", "outliers", "n", "mean_us", "median_us", "min_us", "max_us",
               "sd_us", "mad_us", "volume_tests", "triangle_tests"},
              {}};
  for (const Cell& cell : measurements.cells) {
    for (std::size_t k = 0; k < measurements.algorithms.size(); ++k) {
      const Timings& timings = cell.timings[k];
      add_rows(cell, measurements.algorithms[k], "boolean", timings.collide, timings.counts, &table);
      add_rows(cell, measurements.algorithms[k], "distance", timings.distance, {}, &table);
      add_rows(cell, measurements.algorithms[k], "batch of 16", timings.batch, {}, &table);
    }
  }
  return table;
}

Table ratio_table(const Measurements& measurements) {
  const std::vector<double> shares = shares_of(measurements);
  Table table{"ratios_to_fcl", {"pair", "algorithm"}, {}};
  for (const double share : shares) table.columns.push_back(share_text(share));
  std::vector<std::string> pairs;
  for (const Cell& cell : measurements.cells)
    if (pairs.empty() || pairs.back() != cell.pair) pairs.push_back(cell.pair);
  for (const std::string& pair : pairs) {
    Measurements of_pair;
    of_pair.algorithms = measurements.algorithms;
    for (const Cell& cell : measurements.cells)
      if (cell.pair == pair) of_pair.cells.push_back(cell);
    for (const std::string& algorithm : measurements.algorithms) {
      if (algorithm == kFcl) continue;
      std::vector<Figure> row = {pair, algorithm};
      for (const double share : shares) {
        const std::optional<Ratio> ratio = speed_ratio(of_pair, algorithm, kFcl, Query::kCollide, std::span(&share, 1));
        row.emplace_back(ratio ? ratio->value : kEmptyCell);
      }
      table.rows.push_back(std::move(row));
    }
  }
  return table;
}

double typical_microseconds(const Measurements& measurements, std::size_t algorithm, Query query, double share) {
  std::vector<double> each;
  for (const Cell& cell : measurements.cells) {
    if (cell.share != share) continue;
    const std::vector<double> seconds = measured(cell.timings[algorithm].*seconds_of(query));
    if (!seconds.empty()) each.push_back(1e6 * median(seconds));
  }
  return each.empty() ? kEmptyCell : geometric_mean(each);
}

Table summary_table(const Measurements& measurements) {
  const std::vector<double> shares = shares_of(measurements);
  Table table{"summary", {"algorithm", "query"}, {}};
  for (const double share : shares) table.columns.push_back(share_text(share));
  for (std::size_t k = 0; k < measurements.algorithms.size(); ++k) {
    for (const auto& [name, query] :
         {std::pair("boolean", Query::kCollide), std::pair("boolean, repeated", Query::kCollideRepeated),
          std::pair("distance", Query::kDistance)}) {
      std::vector<Figure> row = {measurements.algorithms[k], std::string(name)};
      bool any = false;
      for (const double share : shares) {
        const double value = typical_microseconds(measurements, k, query, share);
        any = any || !std::isnan(value);
        row.emplace_back(value);
      }
      if (any) table.rows.push_back(std::move(row));
    }
  }
  return table;
}

Table target_table(const Measurements& measurements) {
  const std::vector<double> shares = shares_of(measurements);
  Table table{"instruction_sets", {"target"}, {}};
  for (const double share : shares) table.columns.push_back(share_text(share));
  if (measurements.cells.empty()) return table;
  for (std::size_t t = 0; t < measurements.cells.front().targets.size(); ++t) {
    std::vector<Figure> row = {measurements.cells.front().targets[t].target};
    for (const double share : shares) {
      std::vector<double> each;
      for (const Cell& cell : measurements.cells)
        if (cell.share == share) each.push_back(1e6 * median(cell.targets[t].collide));
      row.emplace_back(geometric_mean(each));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table cost_table(const Measurements& measurements) {
  Table table{"costs", {"mesh", "triangles", "algorithm", "build_ms", "bytes_a_triangle"}, {}};
  for (const MeshCost& cost : measurements.costs) {
    table.rows.push_back({cost.mesh, static_cast<std::int64_t>(cost.triangles), cost.algorithm, 1e3 * cost.cost.seconds,
                          cost.cost.bytes ? *cost.cost.bytes / cost.triangles : kEmptyCell});
  }
  return table;
}

Table wrong_answer_table(const Measurements& measurements) {
  Table table{"wrong_answers", {"pair", "distance", "algorithm", "answer", "exact", "distance_um", "X_AB"}, {}};
  for (const WrongAnswer& wrong : measurements.wrong) {
    std::string X_AB;
    for (const float value : wrong.X_AB.rotation) X_AB += exact_text(value) + " ";
    for (const float value : wrong.X_AB.translation) X_AB += exact_text(value) + " ";
    X_AB.pop_back();
    table.rows.push_back({wrong.pair, wrong.share, wrong.algorithm, wrong.answer ? "collides" : "apart",
                          wrong.answer ? "apart" : "collides", 1e6 * wrong.distance, X_AB});
  }
  return table;
}

Table distance_difference_table(const Measurements& measurements) {
  Table table{"distance_differences", {"pair", "distance", "algorithm", "answer_um", "exact_um"}, {}};
  for (const DistanceDifference& difference : measurements.distance_differences)
    table.rows.push_back(
        {difference.pair, difference.share, difference.algorithm, 1e6 * difference.distance, 1e6 * difference.exact});
  return table;
}

Table wrong_answer_counts(const Measurements& measurements) {
  Table table{
      "answers", {"algorithm", "answers", "wrongly_colliding", "wrongly_apart", "wrong_distances", "differs"}, {}};
  for (std::size_t k = 0; k < measurements.algorithms.size(); ++k) {
    std::int64_t asked = 0;
    for (const Cell& cell : measurements.cells)
      asked += static_cast<std::int64_t>(measured(cell.timings[k].collide).size());
    std::int64_t colliding = 0, apart = 0;
    for (const WrongAnswer& wrong : measurements.wrong)
      if (wrong.algorithm == measurements.algorithms[k]) ++(wrong.answer ? colliding : apart);
    const std::int64_t distances = std::count_if(
        measurements.distance_differences.begin(), measurements.distance_differences.end(),
        [&](const DistanceDifference& difference) { return difference.algorithm == measurements.algorithms[k]; });
    table.rows.push_back({measurements.algorithms[k], asked, colliding, apart, distances, measurements.differs[k]});
  }
  return table;
}

}  // namespace prescene::benchmarks
