// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/dice_steps.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "benchmarks/processor_time.h"
#include "prescene/core/check.h"
#include "prescene/geometry/sampling.h"
#include "prescene/service/backends.h"
#include "tests/support/simple_scenes.h"

namespace prescene::benchmarks {
namespace {

constexpr std::array kRatios = {0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.4, 1.7, 2.0};
constexpr std::array kWidths = {0.005, 0.013, 0.04};
constexpr double kFineStep = 1.0 / 7680.0;

struct Throw {
  const char* name;
  double height, speed, fall, spin;  ///< m above the floor, m/s along it and down, rad/s in each axis
  double restitution, friction;
};
constexpr std::array kThrows = {
    Throw{"dropped", 0.1, 0.0, 0.0, 8.0, 0.5, 0.3},   Throw{"thrown", 0.05, 1.0, 0.0, 40.0, 0.5, 0.3},
    Throw{"hard", 0.05, 2.0, 1.0, 100.0, 0.5, 0.3},   Throw{"dull", 0.03, 0.5, 0.0, 20.0, 0.2, 0.3},
    Throw{"lively", 0.05, 1.0, 0.0, 40.0, 0.7, 0.15},
};

struct Shares {
  double square = 0.0;  ///< That land on a square face.
  double cpu = 0.0;     ///< s, of one.
  double step = 0.0;    ///< s
};

Shares throw_dice(const belief::Scene& scene, const Throw& how, int count, std::uint64_t seed, core::ThreadPool& pool) {
  service::Backends backends(pool);
  const auto simulator = backends.make_simulator(scene);
  PRESCENE_CHECK(simulator.ok());
  core::RandomStream stream(seed, core::Purpose::kTest);
  std::vector<belief::WorldState> starts;
  for (int i = 0; i < count; ++i) {
    belief::WorldState start = belief::mean_start(scene);
    start.objects[0].X_WO = {geometry::uniform_rotation(stream), {0.0, 0.0, how.height}};
    start.objects[0].V_WO.linear = {how.speed, 0.0, -how.fall};
    start.objects[0].V_WO.angular = how.spin * geometry::normal_vector(stream);
    starts.push_back(start);
  }
  simulation::RunRequest request;
  request.stop.duration = 8.0;
  std::vector<belief::Trajectory> runs(starts.size());
  const double before = processor_seconds();
  (*simulator)->run(starts, request, stream, 0, pool, runs);
  Shares shares;
  shares.cpu = (processor_seconds() - before) / count;
  shares.step = (*simulator)->step_size();
  for (const belief::Trajectory& run : runs) {
    Eigen::Index axis = 0;
    run.final().objects[0].X_WO.rotation.toRotationMatrix().row(2).cwiseAbs().maxCoeff(&axis);
    shares.square += axis == 2 ? 1.0 / count : 0.0;
  }
  return shares;
}

}  // namespace

Table measure_dice_steps(int count, Report* report) {
  Table table{"dice_steps",
              {"throw", "width mm", "height / width", "square, auto", "square, 1/7680 s", "steps a second",
               "cpu ms, auto", "cpu ms, 1/7680 s"},
              {}};
  core::ThreadPool pool(1);
  std::vector<double> squares;
  for (const Throw& how : kThrows) {
    std::fprintf(stderr, "dice, %s\n", how.name);
    for (const double width : kWidths) {
      for (const double ratio : kRatios) {
        belief::ObjectModel model = tests::primitive_model("die", geometry::BoxShape{{width, width, ratio * width}},
                                                           7800.0 * ratio * width * width * width);
        model.contact.friction = belief::FixedScalar{how.friction};
        model.contact.restitution = belief::FixedScalar{how.restitution};
        belief::Scene scene = tests::floor_scene(model);
        const std::uint64_t seed = 2 * table.rows.size() + 1;  // Each cell has chance errors of its own.
        const Shares found = throw_dice(scene, how, count, seed, pool);
        scene.step = kFineStep;
        const Shares fine = throw_dice(scene, how, count, seed + 1, pool);
        const auto variance = [&](double p) { return p * (1.0 - p) / (count - 1); };
        const double difference = found.square - fine.square;
        squares.push_back(difference * difference - variance(found.square) - variance(fine.square));
        table.rows.push_back({how.name, 1e3 * width, ratio, found.square, fine.square, 1.0 / found.step,
                              1e3 * found.cpu, 1e3 * fine.cpu});
      }
    }
  }
  const auto cells = static_cast<double>(squares.size());
  double mean = 0.0, spread = 0.0;
  for (const double square : squares) mean += square / cells;
  for (const double square : squares) spread += (square - mean) * (square - mean);
  const double error = std::sqrt(spread / (cells * (cells - 1.0)));
  const auto root = [](double square) { return std::sqrt(std::max(0.0, square)); };
  char why[160];
  std::snprintf(why, sizeof why, "one standard error: %.4f to %.4f; %d throws a cell and step", root(mean - error),
                root(mean + error), count);
  report->add({.work = "dice, share of square faces at the step by itself against 1/7680 s, RMS",
               .better = Better::kLower,
               .must = at_most(0.015),
               .aim = at_most(0.008),
               .reached = root(mean),
               .unit = "",
               .n = static_cast<std::int64_t>(squares.size()),
               .baseline = "the same simulator at 1/7680 s",
               .why = why});
  return table;
}

}  // namespace prescene::benchmarks
