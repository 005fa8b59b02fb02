// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/dice_engines.h"

#include <cmath>
#include <cstdio>
#include <vector>

#include "benchmarks/dice.h"
#include "benchmarks/processor_time.h"
#include "prescene/core/check.h"
#include "prescene/service/backends.h"
#include "tests/peers/scene_mujoco.h"

namespace prescene::benchmarks {
namespace {

/// Contacts that sink in little beside a die of millimetres: their time constant is four steps.
constexpr tests::MujocoOptions kStiff = {.step = 5e-5, .contact_time = 2e-4, .rest_time = 0.1};

double share_in_lockstep(const belief::Scene& scene, const std::vector<belief::WorldState>& starts,
                         core::ThreadPool& pool) {
  service::Backends backends(pool);
  const auto simulator = backends.make_simulator(scene);
  PRESCENE_CHECK(simulator.ok());
  simulation::RunRequest request;
  request.stop.duration = kDiceDuration;
  std::vector<belief::Trajectory> runs(starts.size());
  (*simulator)->run(starts, request, core::RandomStream(1, core::Purpose::kEvaluation), 0, pool, runs);
  double square = 0.0;
  for (const belief::Trajectory& run : runs) square += lies_on_square_face(run.final()) ? 1.0 : 0.0;
  return square / static_cast<double>(starts.size());
}

}  // namespace

Table measure_dice_in_mujoco(int ours, int theirs, Report* report) {
  Table table{"dice",
              {"throw", "width mm", "height / width", "square, lockstep", "square, mujoco", "blown up in mujoco",
               "cpu ms, mujoco"},
              {}};
  core::ThreadPool pool(1);
  const RootMeanSquare error = compare_dice([&](const DiceKind& kind) -> SquareShares {
    const std::uint64_t seed = 2 * kind.number + 10'001;
    const double in_lockstep = share_in_lockstep(kind.scene, dice_starts(kind.scene, kind.how, ours, seed), pool);
    tests::MujocoScene engine(kind.scene, kStiff);
    int square = 0, ended = 0;
    const double before = processor_seconds();
    for (const belief::WorldState& start : dice_starts(kind.scene, kind.how, theirs, seed + 1)) {
      const belief::Trajectory run = engine.run(start, kDiceDuration);
      if (run.end == belief::TrajectoryEnd::kDiverged) continue;
      ++ended;
      square += lies_on_square_face(run.final()) ? 1 : 0;
    }
    const double cpu = (processor_seconds() - before) / theirs;
    PRESCENE_CHECK(ended > 1);
    const double in_mujoco = static_cast<double>(square) / ended;
    table.rows.push_back({kind.how.name, 1e3 * kind.width, kind.ratio, in_lockstep, in_mujoco,
                          static_cast<std::int64_t>(theirs - ended), 1e3 * cpu});
    return {in_lockstep, in_mujoco, ours, ended};
  });
  char why[160];
  std::snprintf(why, sizeof why, "one standard error: %.4f to %.4f; %d and %d throws a cell", error.low, error.high,
                ours, theirs);
  report->add({.work = "dice, share of square faces against MuJoCo at 1/20,000 s, RMS",
               .better = Better::kLower,
               .must = at_most(0.03),
               .aim = at_most(0.02),
               .reached = error.value,
               .unit = "",
               .n = kDiceKinds,
               .baseline = "MuJoCo 2.2.2, elliptic cones, contacts with a time constant of 0.2 ms",
               .why = why});
  return table;
}

}  // namespace prescene::benchmarks
