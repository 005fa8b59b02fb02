// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "benchmarks/processor_time.h"
#include "benchmarks/simulator_laws.h"
#include "prescene/core/check.h"
#include "prescene/service/backends.h"
#include "prescene/service/load_scene.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "tests/support/paths.h"

namespace prescene::benchmarks {
namespace {

/// As a user would write it: the bottle as its hull, the mug as it comes, which is as a tree of spheres.
std::string scene_text(const std::string& meshes) {
  return R"(name: scanned_bottle_beside_mug
duration: 8.0
models:
  bottle:
    mesh: {file: )" +
         meshes + R"(/household/ycb_bleach_cleanser.ply, use: convex_hull}
    mass: 0.5
    friction: {normal: [0.4, 0.06], min: 0.05}
    restitution: 0.1
  mug:
    mesh: {file: )" +
         meshes + R"(/household/ycb_mug.ply}
    mass: 0.12
    friction: {normal: [0.4, 0.06], min: 0.05}
    restitution: 0.1
    rolling_friction: 0.0005
supports:
  table:
    box: [1.2, 0.8, 0.04]
    pose: {position: [0, 0, -0.02]}
    friction: 1.0
    restitution: 1.0
objects:
  mug:
    model: mug
    pose: {position: [0.11, 0.0, 0.041]}
  bottle:
    model: bottle
    pose:
      position: [0, 0, 0.135]
      normal: {position: [0.005, 0.005, 0.002], rotation_deg: [8, 8, 30]}
exclusive_outcomes:
  ends:
    object: bottle
    outcomes:
      stands: {upright: {within_deg: 20}}
      lies: {not: {upright: {within_deg: 60}}}
outcomes:
  mug_moved: {object: mug, moved_more_than: 0.02}
)";
}

/// Runs the starts and returns the processor time of an instance, s.
double run_all(const simulation::Simulator& simulator, const belief::Scene& scene,
               std::span<const belief::WorldState> starts, core::ThreadPool& pool,
               std::vector<belief::Trajectory>& runs) {
  simulation::RunRequest request;
  request.stop.duration = scene.duration;
  runs.assign(starts.size(), {});
  const double before = processor_seconds();
  simulator.run(starts, request, core::RandomStream(1, core::Purpose::kEvaluation), 0, pool, runs);
  return (processor_seconds() - before) / static_cast<double>(starts.size());
}

}  // namespace

Table measure_scanned_pair(int instances, int in_bullet, Report* report) {
  Table table{"scanned_pair", {"class", "lockstep", "bullet, full hulls", "shift, points", "half width, points"}, {}};
  Target cost{.work = "scanned bottle let go beside a scanned mug, processor time an instance",
              .better = Better::kLower,
              .must = at_most(6.0),
              .aim = at_most(2.0),
              .reached = std::nullopt,
              .unit = "ms",
              .n = instances,
              .baseline = "none",
              .why = {}};
  Target shift{.work = "the same, largest shift of an outcome against Bullet's stepper with full hulls",
               .better = Better::kLower,
               .must = at_most(2.0),
               .aim = at_most(1.0),
               .reached = std::nullopt,
               .unit = "points",
               .n = in_bullet,
               .baseline = "Bullet's stepper, the same starts",
               .why = {}};
  const auto meshes = tests::data_dir("meshes");
  if (!meshes) {
    cost.why = shift.why = tests::missing_data_message("meshes");
  } else {
    std::fprintf(stderr, "scanned bottle and mug\n");
    const auto read = service::load_scene_text(scene_text(std::filesystem::absolute(*meshes)), "scanned_pair.yaml", {});
    PRESCENE_CHECK_MSG(read.ok(), read.status().message());
    const std::shared_ptr<const belief::Scene>& scene = *read;
    const simulation::StartDistribution distribution = simulation::start_of(scene);
    const simulation::StartSampler sampler(distribution.components.front(), 7);
    std::vector<belief::WorldState> starts;
    for (int i = 0; i < std::max(instances, in_bullet); ++i)
      starts.push_back(sampler.draw(static_cast<std::uint32_t>(i)));
    core::ThreadPool pool(1);
    std::vector<belief::Trajectory> runs, full;
    service::BackendSettings settings;
    settings.stepper = service::Stepper::kLockstep;
    service::Backends lockstep(pool, settings);
    const auto ours = lockstep.make_simulator(*scene);
    PRESCENE_CHECK_MSG(ours.ok(), ours.status().message());
    cost.reached =
        1e3 * run_all(**ours, *scene, std::span(starts).first(static_cast<std::size_t>(instances)), pool, runs);
    run_all(**ours, *scene, std::span(starts).first(static_cast<std::size_t>(in_bullet)), pool, runs);
    settings.stepper = service::Stepper::kBullet;
    service::Backends bullet(pool, settings);
    const auto theirs = bullet.make_simulator(*scene);
    PRESCENE_CHECK_MSG(theirs.ok(), theirs.status().message());
    const double full_cost =
        run_all(**theirs, *scene, std::span(starts).first(static_cast<std::size_t>(in_bullet)), pool, full);
    char text[160];
    std::snprintf(text, sizeof text, "%.2f s in Bullet's stepper; hulls lie up to %.2f mm inside", full_cost,
                  1e3 * (*ours)->stepper().hull_error);
    cost.why = text;
    double largest = 0.0, half_width = 0.0;
    for (const simulation::Variable& variable :
         simulation::variables_of(scene, scene->outcomes, scene->exclusive_outcomes)) {
      for (std::size_t c = 0; c < variable.classes.size(); ++c) {
        double a = 0.0, b = 0.0, changed = 0.0;
        for (std::size_t i = 0; i < full.size(); ++i) {
          const double in_a = variable.classify(runs[i]) == static_cast<int>(c) ? 1.0 : 0.0;
          const double in_b = variable.classify(full[i]) == static_cast<int>(c) ? 1.0 : 0.0;
          a += in_a / in_bullet;
          b += in_b / in_bullet;
          changed += std::abs(in_a - in_b) / in_bullet;
        }
        const double width = 100.0 * 1.96 * std::sqrt(std::max(changed, 1.0 / in_bullet) / in_bullet);
        if (100.0 * std::abs(a - b) >= largest) {
          largest = 100.0 * std::abs(a - b);
          half_width = width;
        }
        table.rows.push_back({variable.name + ": " + variable.classes[c], a, b, 100.0 * (a - b), width});
      }
    }
    shift.reached = largest;
    std::snprintf(text, sizeof text, "95 %% interval +-%.1f, by the starts that end otherwise", half_width);
    shift.why = text;
  }
  report->add(std::move(cost));
  report->add(std::move(shift));
  return table;
}

}  // namespace prescene::benchmarks
