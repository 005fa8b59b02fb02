// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/toss_targets.h"

#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>

#include "prescene/core/check.h"
#include "prescene/service/calibration/toss_evaluation.h"
#include "prescene/service/evaluate/cube_tosses.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

Target target_of(const std::string& work, Better better, Goal must, Goal aim, const std::string& unit) {
  Target target;
  target.work = work;
  target.better = better;
  target.must = must;
  target.aim = aim;
  target.unit = unit;
  target.baseline = "none";
  return target;
}

/// As a lab writes it that knows of its cube and board what the data set says, and little of friction and bounce.
constexpr char kScene[] = R"(name: cube
gravity: [0, 0, -9.61]
duration: 3
models:
  cube:
    box: [0.1026, 0.1026, 0.1026]
    mass: 0.37
    inertia: [0.00081, 0.00081, 0.00081]
    friction: {normal: [0.18, 0.1]}
    impact_friction: {normal: [0.18, 0.1]}
    restitution: {normal: [0.2, 0.15]}
supports:
  board:
    ground: {size: 4}
    friction: 1
    restitution: 1
objects:
  cube:
    model: cube
    pose: {position: [0, 0, 0.2]}
)";

/// The folder that `prescene calibrate` and `prescene evaluate` take, of these tosses.
core::Result<service::MotionDataset> dataset_of(const std::vector<service::CubeToss>& tosses,
                                                const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "scene.yaml") << kScene;
  std::ofstream table(folder / "tosses.csv");
  table.precision(12);
  table << "toss,t,x,y,z,qw,qx,qy,qz\n";
  for (const service::CubeToss& toss : tosses) {
    for (const simulation::TimedPose& frame : toss.frames) {
      const auto& p = frame.X_WO.translation;
      const auto& q = frame.X_WO.rotation;
      table << toss.number << ',' << frame.time << ',' << p.x() << ',' << p.y() << ',' << p.z() << ',' << q.w() << ','
            << q.x() << ',' << q.y() << ',' << q.z() << '\n';
    }
  }
  table.close();
  return service::read_motion_dataset(folder, [](core::LogLevel, std::string_view) {});
}

void measure_shipped_model(Report* report) {
  const std::string name = "real tosses, report half, ";
  Target brier = target_of(name + "Brier", Better::kLower, at_most(0.10), at_most(0.05), "");
  Target error = target_of(name + "median xy error", Better::kLower, at_most(18.0), at_most(13.0), "mm");
  Target coverage =
      target_of(name + "coverage of the 90 % region", Better::kWithin, Goal{0.84, 0.96}, Goal{0.87, 0.95}, "");
  core::ThreadPool threads;
  core::Result<service::CubeReport> found = core::not_found(tests::missing_data_message("cube_tosses"));
  if (const auto folder = tests::data_dir("cube_tosses"))
    found = service::evaluate_cube_tosses(*folder, service::CubeSplit::kReport, 1, threads);
  if (found) {
    brier.reached = found->brier;
    error.reached = 1e3 * found->median_xy_error_m;
    coverage.reached = found->coverage_90;
  }
  for (Target* one : {&brier, &error, &coverage}) {
    one->n = found ? found->n : 0;
    one->why = found ? "`prescene evaluate cube_tosses`, seed 1" : std::string(found.status().message());
    report->add(std::move(*one));
  }
}

}  // namespace

void measure_tosses(int folds, Report* report) {
  measure_shipped_model(report);
  const std::string name = "real tosses, " + std::to_string(folds) + " parts, each forecast by a fit to the others, ";
  Target brier = target_of(name + "Brier", Better::kLower, at_most(0.055), at_most(0.045), "");
  Target error = target_of(name + "median error", Better::kLower, at_most(13.0), at_most(12.0), "mm");
  Target coverage =
      target_of(name + "coverage of the 90 % region", Better::kWithin, Goal{0.88, 0.93}, Goal{0.89, 0.92}, "");
  Target time = target_of("`calibrate` on the tosses at even places, 2 threads", Better::kLower, at_most(10.0),
                          at_most(3.0), "min");
  const auto data = tests::data_dir("cube_tosses");
  if (!data || folds < 2) {
    for (Target* one : {&brier, &error, &coverage, &time}) {
      one->why = data ? "left out by --folds" : tests::missing_data_message("cube_tosses");
      report->add(std::move(*one));
    }
    return;
  }
  const tests::ScratchDir scratch;
  core::ThreadPool pool(2);
  service::Backends backends(pool);
  const auto tosses = service::read_cube_tosses(*data);
  PRESCENE_CHECK_MSG(tosses.ok(), tosses.status().message());

  const auto half = dataset_of(select(*tosses, service::CubeSplit::kCalibrate), scratch.path() / "even");
  PRESCENE_CHECK_MSG(half.ok(), half.status().message());
  std::fprintf(stderr, "calibration, %zu tosses\n", half->recordings.size());
  const auto begin = std::chrono::steady_clock::now();
  const auto fitted = service::calibrate_object(*half, backends, {});
  PRESCENE_CHECK_MSG(fitted.ok(), fitted.status().message());
  time.reached = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() / 60.0;
  time.n = static_cast<std::int64_t>(half->recordings.size());
  time.why = "wall time of one fit";

  const auto all = dataset_of(*tosses, scratch.path() / "all");
  PRESCENE_CHECK_MSG(all.ok(), all.status().message());
  std::fprintf(stderr, "%d parts of %zu tosses\n", folds, all->recordings.size());
  const auto found = service::evaluate_folds(*all, folds, backends, {});
  PRESCENE_CHECK_MSG(found.ok(), found.status().message());
  const service::TossScores& scores = found->scores;
  const auto set = [&](Target* target, const service::ScoreValue& value, double factor) {
    target->reached = factor * value.value;
    target->n = scores.n;
    char text[64];
    std::snprintf(text, sizeof text, "one standard error: %.3g; twins together", factor * value.standard_error);
    target->why = text;
  };
  set(&brier, scores.brier, 1.0);
  set(&error, scores.median_error, 1e3);
  set(&coverage, scores.coverage[2].held, 1.0);
  for (Target* one : {&brier, &error, &coverage, &time}) report->add(std::move(*one));
}

}  // namespace prescene::benchmarks
