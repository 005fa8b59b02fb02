// SPDX-License-Identifier: Apache-2.0
// Times collision algorithms against each other on the same configurations.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "benchmarks/collision_algorithms.h"
#include "tests/support/collision_meshes.h"

namespace prescene::benchmarks {

struct MeasureOptions {
  int configurations = 32;  ///< A cell; half by the sphere method, half by the grid method.
  int batches = 6;          ///< A cell, of 16 near configurations each.
  int rounds = 7;
  double block = 4e-6;  ///< s: a query that is repeated goes on for at least this long in each round.
  /// Boolean queries only, each after something else has filled the caches.
  bool cold = false;
  int slow_stride = 4;  ///< Slow algorithms are measured on every so many configurations.
  std::uint64_t seed = 2007;
};

/// Queries that are asked one after another, as in use: on the same meshes, each of them another.
struct Stream {
  std::function<void()> before = [] {};  ///< Not timed.
  std::vector<std::function<void()>> queries;
};

/// Seconds each query takes, stream by stream: each is clocked by itself, less what the clock takes; the smallest of
/// the rounds. In each round every stream has its turn, in rotating order, first once untimed: so all see the same
/// state of the machine, and caches hold what a stream of queries on these meshes leaves there. `cold`: instead the
/// caches are filled with other things before each query.
std::vector<std::vector<double>> time_streams(std::span<const Stream> streams, int rounds, bool cold = false);

/// Seconds a call of each of `queries` when it is asked again and again, so that the processor has learnt it by heart;
/// otherwise likewise.
std::vector<double> time_repeated(std::span<const std::function<void()>> queries, const MeasureOptions& options);

/// Of one algorithm in one cell; an entry a configuration, NaN where it was not measured.
struct Timings {
  std::vector<double> collide;       ///< s, in a stream.
  std::vector<double> repeated;      ///< s, the same again and again.
  std::vector<bool> answers;         ///< Of collide; where measured.
  std::vector<double> distance;      ///< s; NaN for all without distances.
  std::vector<double> distances;     ///< m; empty without distances.
  std::vector<WorkCounts> counts;    ///< Empty without counts.
  std::vector<double> batch;         ///< s for all 16 of a batch, an entry a batch; empty without batches.
  std::vector<double> batch_single;  ///< s for the same 16 one by one.
};

/// The default tree with fewer instructions than the machine has.
struct TargetTiming {
  std::string target;           ///< As Highway calls it; the best one first.
  std::vector<double> collide;  ///< s, an entry a configuration.
};

/// A pair of meshes at one distance.
struct Cell {
  std::string pair;
  double share =
      0.0;  ///< Distance as a share of the smaller object's size; negative: overlap as a share of its volume.
  std::vector<collision::Transform> configurations;
  std::vector<bool> collides;    ///< The truth: what all algorithms say, or the exact reference where they differ.
  int decided_by_reference = 0;  ///< Configurations.
  std::vector<Timings> timings;  ///< In the order of the algorithms.
  std::vector<TargetTiming> targets;
};

/// What building a mesh takes.
struct MeshCost {
  std::string algorithm;
  std::string mesh;
  std::uint32_t triangles = 0;
  BuildCost cost;
};

/// An answer that is not the exact reference's.
struct WrongAnswer {
  std::string pair;
  double share = 0.0;
  std::string algorithm;
  bool answer = false;
  double distance = 0.0;  ///< That the first algorithm with distances finds there, m.
  collision::Transform X_AB;
};

/// Distances of one configuration on which algorithms differ by more than 1e-6 of the size.
struct DistanceDifference {
  std::string pair;
  double share = 0.0;
  std::string algorithm;
  double distance = 0.0;  ///< m
  double exact = 0.0;     ///< By brute force, m.
};

struct Measurements {
  std::vector<std::string> algorithms;
  std::vector<std::string> differs;
  std::vector<bool> ours;
  std::vector<Cell> cells;
  std::vector<MeshCost> costs;
  std::vector<WrongAnswer> wrong;
  std::vector<DistanceDifference> distance_differences;
};

/// Distances and overlaps of the cells of a full run.
std::vector<double> all_shares();

/// Measures `pair` at `shares` and appends to `measurements`, whose algorithms are these. The configurations are made
/// with the distances of the first algorithm that has them.
void measure_pair(const tests::MeshPair& pair, std::span<const Algorithm> algorithms, std::span<const double> shares,
                  const MeasureOptions& options, Measurements* measurements);

}  // namespace prescene::benchmarks
