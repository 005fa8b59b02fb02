// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "benchmarks/collision_tables.h"
#include "benchmarks/statistics.h"

namespace prescene::benchmarks {
namespace {

std::optional<std::size_t> index_of(const Measurements& measurements, std::string_view name) {
  const auto found = std::find(measurements.algorithms.begin(), measurements.algorithms.end(), name);
  if (found == measurements.algorithms.end()) return std::nullopt;
  return static_cast<std::size_t>(found - measurements.algorithms.begin());
}

bool contains(std::span<const double> shares, double share) {
  return std::find(shares.begin(), shares.end(), share) != shares.end();
}

/// Ratios of slow to fast, cell by cell.
class RatioOfCells {
 public:
  void add(const Cell& cell, const std::vector<double>& slow, const std::vector<double>& fast,
           const std::vector<bool>& use) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < std::min(slow.size(), fast.size()); ++i)
      if (use[i] && !std::isnan(slow[i]) && !std::isnan(fast[i])) ratios.push_back(slow[i] / fast[i]);
    if (ratios.empty()) return;
    cells_.push_back(geometric_mean(ratios));
    n_ += static_cast<std::int64_t>(ratios.size());
    if (std::find(pairs_.begin(), pairs_.end(), cell.pair) == pairs_.end()) pairs_.push_back(cell.pair);
  }

  std::optional<Ratio> joined() const {
    if (cells_.empty()) return std::nullopt;
    return Ratio{geometric_mean(cells_), n_, static_cast<std::int64_t>(pairs_.size())};
  }

 private:
  std::vector<double> cells_;
  std::vector<std::string> pairs_;
  std::int64_t n_ = 0;
};

}  // namespace

std::vector<double> Timings::*seconds_of(Query query) {
  switch (query) {
    case Query::kCollide:
      return &Timings::collide;
    case Query::kCollideRepeated:
      return &Timings::repeated;
    case Query::kDistance:
      return &Timings::distance;
  }
  return nullptr;
}

std::optional<Ratio> speed_ratio(const Measurements& measurements, std::string_view name, std::string_view baseline,
                                 Query query, std::span<const double> shares) {
  const std::optional<std::size_t> fast = index_of(measurements, name), slow = index_of(measurements, baseline);
  if (!fast || !slow) return std::nullopt;
  RatioOfCells ratio;
  for (const Cell& cell : measurements.cells) {
    if (!contains(shares, cell.share)) continue;
    const Timings &of_fast = cell.timings[*fast], &of_slow = cell.timings[*slow];
    std::vector<bool> right(cell.configurations.size(), true);
    for (std::size_t i = 0; i < right.size(); ++i)
      right[i] = query == Query::kDistance ||
                 (of_fast.answers[i] == cell.collides[i] && of_slow.answers[i] == cell.collides[i]);
    const std::vector<double> Timings::*seconds = seconds_of(query);
    ratio.add(cell, of_slow.*seconds, of_fast.*seconds, right);
  }
  return ratio.joined();
}

std::optional<Ratio> batch_ratio(const Measurements& measurements, std::string_view name,
                                 std::span<const double> shares) {
  const std::optional<std::size_t> index = index_of(measurements, name);
  if (!index) return std::nullopt;
  RatioOfCells ratio;
  for (const Cell& cell : measurements.cells) {
    const Timings& timings = cell.timings[*index];
    if (contains(shares, cell.share))
      ratio.add(cell, timings.batch_single, timings.batch, std::vector<bool>(timings.batch.size(), true));
  }
  return ratio.joined();
}

std::optional<double> bytes_a_triangle(const Measurements& measurements, std::string_view name,
                                       std::uint32_t least_triangles) {
  double bytes = 0.0, triangles = 0.0;
  for (const MeshCost& cost : measurements.costs) {
    if (cost.algorithm != name || cost.triangles < least_triangles || !cost.cost.bytes) continue;
    bytes += *cost.cost.bytes;
    triangles += cost.triangles;
  }
  if (triangles == 0.0) return std::nullopt;
  return bytes / triangles;
}

}  // namespace prescene::benchmarks
