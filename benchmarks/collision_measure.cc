// SPDX-License-Identifier: Apache-2.0
#include "prescene/benchmarks/collision_measure.h"

#include <hwy/targets.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "prescene/core/check.h"
#include "prescene/tests/support/brute_force.h"
#include "prescene/tests/support/contact_configurations.h"

namespace prescene::benchmarks {
namespace {

using collision::Transform;
using tests::ContactConfigurations;
using tests::PlacementMethod;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double time_block(const std::function<void()>& query, int repeats) {
  const double start = seconds_now();
  for (int i = 0; i < repeats; ++i) query();
  return (seconds_now() - start) / repeats;
}

using Solvers = std::vector<std::unique_ptr<PairSolver>>;

std::vector<Transform> make_configurations(ContactConfigurations& make, double share, int count) {
  std::vector<Transform> configurations;
  for (const PlacementMethod method : {PlacementMethod::kSphere, PlacementMethod::kGrid}) {
    const int half = method == PlacementMethod::kSphere ? count - count / 2 : count / 2;
    const std::vector<Transform> made =
        share < 0.0 ? make.penetrating(-share, half, method) : make.at_distance(share, half, method);
    configurations.insert(configurations.end(), made.begin(), made.end());
  }
  return configurations;
}

/// Asks all for their answers, untimed; fills answers, distances and counts.
void ask(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options, Cell* cell) {
  const auto stride = static_cast<std::size_t>(options.slow_stride);
  for (std::size_t k = 0; k < algorithms.size(); ++k) {
    Timings& timings = cell->timings[k];
    for (std::size_t i = 0; i < cell->configurations.size(); ++i) {
      const Transform& X_AB = cell->configurations[i];
      const bool asked = !algorithms[k].slow || i % stride == 0;
      timings.answers.push_back(asked && solvers[k]->collide(X_AB));
      timings.collide.push_back(asked ? 0.0 : kNone);
      if (algorithms[k].has_distance) timings.distances.push_back(solvers[k]->distance(X_AB));
      if (algorithms[k].has_counts) timings.counts.push_back(solvers[k]->count(X_AB));
    }
  }
}

void decide(const tests::MeshPair& pair, std::span<const Algorithm> algorithms, Cell* cell,
            Measurements* measurements) {
  const auto with_distance = std::find_if(algorithms.begin(), algorithms.end(),
                                          [](const Algorithm& algorithm) { return algorithm.has_distance; });
  for (std::size_t i = 0; i < cell->configurations.size(); ++i) {
    int yes = 0, no = 0;
    for (const Timings& timings : cell->timings)
      if (!std::isnan(timings.collide[i])) ++(timings.answers[i] ? yes : no);
    bool truth = yes > 0;
    if (yes > 0 && no > 0) {
      truth = tests::collide_by_brute_force(*pair.a, *pair.b, cell->configurations[i]);
      ++cell->decided_by_reference;
    }
    cell->collides.push_back(truth);
    for (std::size_t k = 0; k < algorithms.size(); ++k) {
      const Timings& timings = cell->timings[k];
      if (std::isnan(timings.collide[i]) || timings.answers[i] == truth) continue;
      double distance = kNone;
      if (with_distance != algorithms.end())
        distance = cell->timings[static_cast<std::size_t>(with_distance - algorithms.begin())].distances[i];
      measurements->wrong.push_back(
          {cell->pair, cell->share, algorithms[k].name, timings.answers[i], distance, cell->configurations[i]});
    }
  }
}

void time_singles(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options,
                  Cell* cell) {
  for (std::size_t i = 0; i < cell->configurations.size(); ++i) {
    const Transform& X_AB = cell->configurations[i];
    std::vector<std::function<void()>> queries;
    std::vector<std::pair<std::size_t, bool>> of;  // algorithm, whether the distance
    for (std::size_t k = 0; k < algorithms.size(); ++k) {
      PairSolver* solver = solvers[k].get();
      if (!std::isnan(cell->timings[k].collide[i])) {
        queries.emplace_back([solver, &X_AB] { solver->collide(X_AB); });
        of.emplace_back(k, false);
      }
      if (algorithms[k].has_distance) {
        queries.emplace_back([solver, &X_AB] { solver->distance(X_AB); });
        of.emplace_back(k, true);
      }
    }
    const std::vector<double> seconds = time_interleaved(queries, options);
    for (std::size_t q = 0; q < queries.size(); ++q) {
      Timings& timings = cell->timings[of[q].first];
      if (of[q].second)
        timings.distance.push_back(seconds[q]);
      else
        timings.collide[i] = seconds[q];
    }
  }
}

void time_in_turn(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options,
                  Cell* cell) {
  std::vector<std::function<void()>> passes;
  std::vector<std::size_t> of;
  for (std::size_t k = 0; k < algorithms.size(); ++k) {
    cell->timings[k].in_turn = kNone;
    if (algorithms[k].slow) continue;
    passes.emplace_back([solver = solvers[k].get(), cell] {
      for (const Transform& X_AB : cell->configurations) solver->collide(X_AB);
    });
    of.push_back(k);
  }
  const std::vector<double> seconds = time_interleaved(passes, options);
  for (std::size_t p = 0; p < passes.size(); ++p)
    cell->timings[of[p]].in_turn = seconds[p] / static_cast<double>(cell->configurations.size());
}

void use_targets(std::int64_t allowed) {
  hwy::SetSupportedTargetsForTest(allowed);
  hwy::GetChosenTarget().DeInit();
}

void time_targets(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options,
                  Cell* cell) {
  const auto chosen = std::find_if(algorithms.begin(), algorithms.end(),
                                   [](const Algorithm& algorithm) { return algorithm.name == kDefaultTree; });
  if (chosen == algorithms.end()) return;
  PairSolver* solver = solvers[static_cast<std::size_t>(chosen - algorithms.begin())].get();
  std::vector<std::function<void()>> passes;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    cell->targets.push_back({hwy::TargetName(target), 0.0});
    passes.emplace_back([solver, cell, target] {
      use_targets(target);
      for (const Transform& X_AB : cell->configurations) solver->collide(X_AB);
    });
  }
  const std::vector<double> seconds = time_interleaved(passes, options);
  use_targets(0);
  for (std::size_t i = 0; i < seconds.size(); ++i)
    cell->targets[i].in_turn = seconds[i] / static_cast<double>(cell->configurations.size());
}

void time_batches(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options,
                  ContactConfigurations& make, Cell* cell) {
  const std::size_t count = cell->configurations.size();
  for (std::size_t i = 0; i < std::min(count, static_cast<std::size_t>(options.batches)); ++i) {
    // Spread over the cell, so that both methods and both sides of a contact have their share.
    const auto batches = static_cast<std::size_t>(options.batches);
    const std::array<Transform, 16> batch =
        make.near(cell->configurations[i * (count - 1) / std::max<std::size_t>(1, batches - 1)]);
    std::array<bool, 16> answers = {};
    for (std::size_t k = 0; k < algorithms.size(); ++k) {
      if (!algorithms[k].has_batches) continue;
      PairSolver* solver = solvers[k].get();
      solver->collide_batch(batch, answers);
      for (std::size_t j = 0; j < batch.size(); ++j) PRESCENE_CHECK(answers[j] == solver->collide(batch[j]));
      const std::vector<std::function<void()>> queries = {[&] { solver->collide_batch(batch, answers); },
                                                          [&] {
                                                            for (const Transform& X_AB : batch) solver->collide(X_AB);
                                                          }};
      const std::vector<double> seconds = time_interleaved(queries, options);
      cell->timings[k].batch.push_back(seconds[0]);
      cell->timings[k].batch_single.push_back(seconds[1]);
    }
  }
}

void note_costs(const tests::MeshPair& pair, std::span<const Algorithm> algorithms, const Solvers& solvers,
                Measurements* measurements) {
  const auto known = [&](const std::string& algorithm, const std::string& mesh) {
    return std::any_of(measurements->costs.begin(), measurements->costs.end(),
                       [&](const MeshCost& cost) { return cost.algorithm == algorithm && cost.mesh == mesh; });
  };
  for (std::size_t k = 0; k < algorithms.size(); ++k) {
    for (const auto& [mesh, cost] : {std::pair(pair.a, solvers[k]->cost_a), std::pair(pair.b, solvers[k]->cost_b)})
      if (!known(algorithms[k].name, mesh->name()))
        measurements->costs.push_back({algorithms[k].name, mesh->name(), mesh->triangle_count(), cost});
  }
}

}  // namespace

std::vector<double> all_shares() { return {0.0, 0.01, 0.05, 0.1, 0.3, -0.01, -0.1}; }

std::vector<double> time_interleaved(std::span<const std::function<void()>> queries, const MeasureOptions& options) {
  std::vector<int> repeats;
  for (const std::function<void()>& query : queries) {
    query();
    const double once = std::max(time_block(query, 1), 1e-9);
    repeats.push_back(std::clamp(static_cast<int>(std::ceil(options.block / once)), 1, 1000));
  }
  std::vector<double> best(queries.size(), std::numeric_limits<double>::infinity());
  for (int round = 0; round < options.rounds; ++round) {
    for (std::size_t turn = 0; turn < queries.size(); ++turn) {
      const std::size_t q = (turn + static_cast<std::size_t>(round)) % queries.size();
      best[q] = std::min(best[q], time_block(queries[q], repeats[q]));
    }
  }
  return best;
}

void measure_pair(const tests::MeshPair& pair, std::span<const Algorithm> algorithms, std::span<const double> shares,
                  const MeasureOptions& options, Measurements* measurements) {
  Solvers solvers;
  PairSolver* oracle = nullptr;
  for (const Algorithm& algorithm : algorithms) {
    solvers.push_back(algorithm.make(pair.a, pair.b));
    if (algorithm.has_distance && oracle == nullptr) oracle = solvers.back().get();
  }
  PRESCENE_CHECK_MSG(oracle != nullptr, "one of the algorithms needs distances");
  measurements->algorithms.clear();
  measurements->differs.clear();
  measurements->ours.clear();
  for (std::size_t k = 0; k < algorithms.size(); ++k) {
    measurements->algorithms.push_back(algorithms[k].name);
    measurements->differs.emplace_back(solvers[k]->differs());
    measurements->ours.push_back(algorithms[k].ours);
  }
  note_costs(pair, algorithms, solvers, measurements);

  ContactConfigurations make(pair.a, pair.b,
                             {[oracle](const Transform& X_AB) { return oracle->collide(X_AB); },
                              [oracle](const Transform& X_AB) { return oracle->distance(X_AB); }},
                             options.seed);
  for (const double share : shares) {
    Cell cell;
    cell.pair = pair.name;
    cell.share = share;
    cell.configurations = make_configurations(make, share, options.configurations);
    cell.timings.resize(algorithms.size());
    if (cell.configurations.empty()) continue;
    ask(algorithms, solvers, options, &cell);
    decide(pair, algorithms, &cell, measurements);
    time_singles(algorithms, solvers, options, &cell);
    time_in_turn(algorithms, solvers, options, &cell);
    time_targets(algorithms, solvers, options, &cell);
    time_batches(algorithms, solvers, options, make, &cell);
    measurements->cells.push_back(std::move(cell));
  }
}

}  // namespace prescene::benchmarks
