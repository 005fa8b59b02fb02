// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "benchmarks/simulator_laws.h"
#include "prescene/core/check.h"
#include "prescene/service/backends.h"
#include "prescene/simulation/outcomes/outcome_estimator.h"
#include "prescene/simulation/similarity.h"
#include "tests/support/engine_scenes.h"
#include "tests/support/uncertain_scenes.h"

namespace prescene::benchmarks {
namespace {

using simulation::Similarity;

constexpr double kWithin = 1.5;  // points

/// Scenes A to D, a thick coin and a carton on a bin's rim.
std::vector<tests::NamedScene> six_scenes() {
  std::vector<tests::NamedScene> scenes = tests::uncertain_scenes();
  for (const tests::EngineScene& engine : tests::engine_scenes())
    if (engine.name.starts_with("thick coin") || engine.name.starts_with("carton falls"))
      scenes.push_back({engine.name, engine.scene});
  PRESCENE_CHECK(scenes.size() == 6);
  return scenes;
}

/// Shares of the classes in the scene that is `similarity` times as large, from the similar starts.
std::vector<double> shares(const tests::NamedScene& named, const simulation::Variable& variable,
                           const std::vector<belief::WorldState>& starts, const Similarity& similarity,
                           core::ThreadPool& pool) {
  service::Backends backends(pool);
  const auto simulator = backends.make_simulator(simulation::scaled(*named.scene, similarity));
  PRESCENE_CHECK_MSG(simulator.ok(), simulator.status().message());
  simulation::RunRequest request;
  request.stop.duration = named.scene->duration * similarity.time();
  request.stop.world_radius = belief::world_radius(simulation::scaled(*named.scene, similarity));
  std::vector<belief::WorldState> similar;
  for (const belief::WorldState& start : starts) similar.push_back(simulation::scaled(start, similarity));
  std::vector<belief::Trajectory> runs(starts.size());
  (*simulator)->run(similar, request, core::RandomStream(1, core::Purpose::kEvaluation), 0, pool, runs);
  std::vector<double> found(variable.classes.size());
  for (belief::Trajectory& run : runs) {
    simulation::scale(similarity.inverse(), run);  // Outcomes are those of the scene as it is.
    found[static_cast<std::size_t>(variable.classify(run))] += 1.0 / static_cast<double>(runs.size());
  }
  return found;
}

}  // namespace

Table measure_scale_law(int instances, Report* report) {
  Table table{"scale_law", {"scene", "class", "as it is", "1/64", "1/8", "8", "64"}, {}};
  core::ThreadPool pool(1);
  double largest = 0.0;
  std::int64_t compared = 0;
  std::string where;
  for (const tests::NamedScene& named : six_scenes()) {
    std::fprintf(stderr, "scale law, %s\n", named.name.c_str());
    const simulation::Variable variable =
        simulation::variables_of(named.scene, {}, named.scene->exclusive_outcomes).front();
    const simulation::StartDistribution distribution = simulation::start_of(named.scene);
    const simulation::StartSampler sampler(distribution.components.front(), 7);
    std::vector<belief::WorldState> starts;
    for (int i = 0; i < instances; ++i) starts.push_back(sampler.draw(static_cast<std::uint32_t>(i)));
    std::vector<std::vector<double>> found;
    for (const double factor : {1.0, 1.0 / 64.0, 1.0 / 8.0, 8.0, 64.0})
      found.push_back(shares(named, variable, starts, Similarity{factor}, pool));
    for (std::size_t c = 0; c < variable.classes.size(); ++c) {
      std::vector<Figure> row = {named.name, variable.classes[c]};
      for (const std::vector<double>& of : found) {
        row.emplace_back(of[c]);
        const double points = 100.0 * std::abs(of[c] - found[0][c]);
        if (points > largest) where = named.name + ", " + variable.classes[c];
        largest = std::max(largest, points);
      }
      compared += 4;
      table.rows.push_back(std::move(row));
    }
  }
  report->add({.work = "scale law, 6 scenes, s = 1/64, 1/8, 8, 64: largest difference of a probability",
               .better = Better::kLower,
               .must = at_most(kWithin),
               .aim = std::nullopt,
               .reached = largest,
               .unit = "points",
               .n = compared,
               .baseline = "the scene as it is, the same starts",
               .why = std::to_string(instances) + " starts a scene and size" + (where.empty() ? "" : "; " + where)});
  return table;
}

}  // namespace prescene::benchmarks
