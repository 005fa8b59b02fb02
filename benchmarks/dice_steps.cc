// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/dice_steps.h"

#include <cstdio>
#include <string>
#include <vector>

#include "benchmarks/dice.h"
#include "benchmarks/processor_time.h"
#include "prescene/core/check.h"
#include "prescene/service/backends.h"

namespace prescene::benchmarks {
namespace {

constexpr double kFineStep = 1.0 / 7680.0;

struct Shares {
  double square = 0.0;  ///< That land on a square face.
  double cpu = 0.0;     ///< s, of one.
  double step = 0.0;    ///< s
};

Shares throw_dice(const belief::Scene& scene, const DiceThrow& how, int count, std::uint64_t seed,
                  core::ThreadPool& pool) {
  service::Backends backends(pool);
  const auto simulator = backends.make_simulator(scene);
  PRESCENE_CHECK(simulator.ok());
  const std::vector<belief::WorldState> starts = dice_starts(scene, how, count, seed);
  simulation::RunRequest request;
  request.stop.duration = kDiceDuration;
  std::vector<belief::Trajectory> runs(starts.size());
  const double before = processor_seconds();
  (*simulator)->run(starts, request, core::RandomStream(seed, core::Purpose::kEvaluation), 0, pool, runs);
  Shares shares;
  shares.cpu = (processor_seconds() - before) / count;
  shares.step = (*simulator)->step_size();
  for (const belief::Trajectory& run : runs) shares.square += lies_on_square_face(run.final()) ? 1.0 / count : 0.0;
  return shares;
}

}  // namespace

Table measure_dice_steps(int count, Report* report) {
  Table table{"dice_steps",
              {"throw", "width mm", "height / width", "square, auto", "square, 1/7680 s", "steps a second",
               "cpu ms, auto", "cpu ms, 1/7680 s"},
              {}};
  core::ThreadPool pool(1);
  const RootMeanSquare error = compare_dice([&](const DiceKind& kind) -> SquareShares {
    const std::uint64_t seed = 2 * kind.number + 1;
    const Shares found = throw_dice(kind.scene, kind.how, count, seed, pool);
    belief::Scene fine_scene = kind.scene;
    fine_scene.step = kFineStep;
    const Shares fine = throw_dice(fine_scene, kind.how, count, seed + 1, pool);
    table.rows.push_back({kind.how.name, 1e3 * kind.width, kind.ratio, found.square, fine.square, 1.0 / found.step,
                          1e3 * found.cpu, 1e3 * fine.cpu});
    return {found.square, fine.square, count, count};
  });
  char why[160];
  std::snprintf(why, sizeof why, "one standard error: %.4f to %.4f; %d throws a cell and step", error.low, error.high,
                count);
  report->add({.work = "dice, share of square faces at the step by itself against 1/7680 s, RMS",
               .better = Better::kLower,
               .must = at_most(0.015),
               .aim = at_most(0.008),
               .reached = error.value,
               .unit = "",
               .n = kDiceKinds,
               .baseline = "the same simulator at 1/7680 s",
               .why = why});
  return table;
}

}  // namespace prescene::benchmarks
