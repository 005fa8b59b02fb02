// SPDX-License-Identifier: Apache-2.0
// The raw figures of collision measurements as tables.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "benchmarks/collision_measure.h"
#include "benchmarks/report.h"

namespace prescene::benchmarks {

/// A row a pair, distance, algorithm and kind of query, with and without outliers: times in microseconds, counts.
Table query_table(const Measurements& measurements);
/// A row an algorithm and distance: geometric means over the pairs of the median times, in microseconds.
Table summary_table(const Measurements& measurements);
/// A row an instruction set: the default tree's boolean queries, medians in microseconds.
Table target_table(const Measurements& measurements);
/// A row a pair and algorithm: how many times faster than FCL in boolean queries, for each distance.
Table ratio_table(const Measurements& measurements);
/// A row a mesh and algorithm.
Table cost_table(const Measurements& measurements);
/// A row an answer that is not the exact reference's.
Table wrong_answer_table(const Measurements& measurements);
/// A row a distance that differs from brute force by more than 1e-6 of the size.
Table distance_difference_table(const Measurements& measurements);
/// A row an algorithm: how many answers were wrong, which way.
Table wrong_answer_counts(const Measurements& measurements);

/// Distances and overlaps, in the order in which they come.
std::vector<double> shares_of(const Measurements& measurements);
/// "touching", "5 %", "overlap 1 %".
std::string share_text(double share);

/// kCollideRepeated: the same query again and again.
enum class Query { kCollide, kCollideRepeated, kDistance };
std::vector<double> Timings::*seconds_of(Query query);
/// Median time in microseconds, geometric mean over pairs; NaN where nothing was measured.
double typical_microseconds(const Measurements& measurements, std::size_t algorithm, Query query, double share);

/// How many times faster `name` is than `baseline`: per pair and distance the geometric mean over the configurations
/// that both answer rightly, then over pairs and `shares`. Nothing when there is no such configuration.
struct Ratio {
  double value = 1.0;
  std::int64_t n = 0;  ///< Configurations.
  std::int64_t pairs = 0;
};
std::optional<Ratio> speed_ratio(const Measurements& measurements, std::string_view name, std::string_view baseline,
                                 Query query, std::span<const double> shares);
/// How many times faster a batch of 16 is than the same poses one by one, likewise; n counts batches.
std::optional<Ratio> batch_ratio(const Measurements& measurements, std::string_view name,
                                 std::span<const double> shares);
/// Bytes a triangle: total over the meshes of more than `least_triangles`.
std::optional<double> bytes_a_triangle(const Measurements& measurements, std::string_view name,
                                       std::uint32_t least_triangles);

}  // namespace prescene::benchmarks
