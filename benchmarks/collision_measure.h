// SPDX-License-Identifier: Apache-2.0
// Times collision algorithms against each other on the same configurations.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "prescene/benchmarks/collision_algorithms.h"
#include "prescene/tests/support/collision_meshes.h"

namespace prescene::benchmarks {

struct MeasureOptions {
  int configurations = 32;  ///< A cell; half by the sphere method, half by the grid method.
  int batches = 4;          ///< A cell, of 16 near configurations each.
  int rounds = 5;
  double block = 4e-6;  ///< s: a query is repeated so often in each round that it takes at least this long.
  int slow_stride = 4;  ///< Slow algorithms are measured on every so many configurations.
  std::uint64_t seed = 2007;
};

/// Seconds a call of each of `queries`: the smallest of the rounds. In each round every query has its turn, in rotating
/// order, so that all see the same state of the machine. Caches are warm.
std::vector<double> time_interleaved(std::span<const std::function<void()>> queries, const MeasureOptions& options);

/// Of one algorithm in one cell; an entry a configuration, NaN where it was not measured.
struct Timings {
  std::vector<double> collide;       ///< s
  std::vector<bool> answers;         ///< Of collide; where measured.
  std::vector<double> distance;      ///< s; empty without distances.
  std::vector<double> distances;     ///< m
  std::vector<WorkCounts> counts;    ///< Empty without counts.
  double in_turn = 0.0;              ///< s a query while one configuration comes after another; NaN if slow.
  std::vector<double> batch;         ///< s for all 16 of a batch, an entry a batch; empty without batches.
  std::vector<double> batch_single;  ///< s for the same 16 one by one.
};

/// The default tree with fewer instructions than the machine has.
struct TargetTiming {
  std::string target;    ///< As Highway calls it; the best one first.
  double in_turn = 0.0;  ///< s a query.
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

struct Measurements {
  std::vector<std::string> algorithms;
  std::vector<std::string> differs;
  std::vector<bool> ours;
  std::vector<Cell> cells;
  std::vector<MeshCost> costs;
  std::vector<WrongAnswer> wrong;
};

/// Distances and overlaps of the cells of a full run.
std::vector<double> all_shares();

/// Measures `pair` at `shares` and appends to `measurements`, whose algorithms are these. The configurations are made
/// with the distances of the first algorithm that has them.
void measure_pair(const tests::MeshPair& pair, std::span<const Algorithm> algorithms, std::span<const double> shares,
                  const MeasureOptions& options, Measurements* measurements);

}  // namespace prescene::benchmarks
