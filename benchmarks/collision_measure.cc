// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/collision_measure.h"

#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "benchmarks/statistics.h"
#include "prescene/core/check.h"
#include "tests/support/brute_force.h"
#include "tests/support/contact_configurations.h"

namespace prescene::benchmarks {
namespace {

using collision::Transform;
using tests::ContactConfigurations;
using tests::PlacementMethod;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// Bytes: more than the caches of the processors that we know.
constexpr std::size_t kOtherThings = std::size_t{96} << 20U;

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

/// Asks all for their answers, untimed; fills answers, distances and counts, and marks what is to be timed.
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
    timings.repeated.assign(cell->configurations.size(), kNone);
    timings.distance.assign(cell->configurations.size(), kNone);
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

/// Lists the distances that are not those of brute force, where there are such.
void decide_distances(const tests::MeshPair& pair, std::span<const Algorithm> algorithms, Cell* cell,
                      Measurements* measurements) {
  const double tolerance = 1e-6 * static_cast<double>(std::min(pair.a->size(), pair.b->size()));
  for (std::size_t i = 0; i < cell->configurations.size(); ++i) {
    double low = std::numeric_limits<double>::infinity(), high = 0.0;
    for (const Timings& timings : cell->timings) {
      if (timings.distances.empty()) continue;
      low = std::min(low, std::max(0.0, timings.distances[i]));
      high = std::max(high, timings.distances[i]);
    }
    if (high - low <= tolerance) continue;
    const double exact = tests::distance_by_brute_force(*pair.a, *pair.b, cell->configurations[i], high + tolerance);
    for (std::size_t k = 0; k < algorithms.size(); ++k) {
      const Timings& timings = cell->timings[k];
      if (!timings.distances.empty() && std::abs(std::max(0.0, timings.distances[i]) - exact) > tolerance)
        measurements->distance_differences.push_back(
            {cell->pair, cell->share, algorithms[k].name, timings.distances[i], exact});
    }
  }
}

void time_booleans(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options,
                   Cell* cell) {
  std::vector<Stream> streams(algorithms.size());
  for (std::size_t k = 0; k < algorithms.size(); ++k) {
    for (std::size_t i = 0; i < cell->configurations.size(); ++i)
      if (!std::isnan(cell->timings[k].collide[i]))
        streams[k].queries.emplace_back(
            [solver = solvers[k].get(), X_AB = &cell->configurations[i]] { solver->collide(*X_AB); });
  }
  const std::vector<std::vector<double>> seconds = time_streams(streams, options.rounds, options.cold);
  for (std::size_t k = 0; k < algorithms.size(); ++k) {
    std::size_t next = 0;
    for (double& value : cell->timings[k].collide)
      if (!std::isnan(value)) value = seconds[k][next++];
  }
}

void time_distances(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options,
                    Cell* cell) {
  std::vector<Stream> streams;
  std::vector<std::size_t> of;
  for (std::size_t k = 0; k < algorithms.size(); ++k) {
    if (!algorithms[k].has_distance) continue;
    of.push_back(k);
    streams.emplace_back();
    for (const Transform& X_AB : cell->configurations)
      streams.back().queries.emplace_back([solver = solvers[k].get(), &X_AB] { solver->distance(X_AB); });
  }
  const std::vector<std::vector<double>> seconds = time_streams(streams, options.rounds);
  for (std::size_t s = 0; s < of.size(); ++s) cell->timings[of[s]].distance = seconds[s];
}

/// Of the default tree and what it is compared with foremost.
void time_again_and_again(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options,
                          Cell* cell) {
  for (std::size_t i = 0; i < cell->configurations.size(); ++i) {
    std::vector<std::function<void()>> queries;
    std::vector<std::size_t> of;
    for (std::size_t k = 0; k < algorithms.size(); ++k) {
      if (algorithms[k].name != kDefaultTree && algorithms[k].name != kFcl) continue;
      of.push_back(k);
      queries.emplace_back([solver = solvers[k].get(), X_AB = &cell->configurations[i]] { solver->collide(*X_AB); });
    }
    const std::vector<double> seconds = time_repeated(queries, options);
    for (std::size_t q = 0; q < of.size(); ++q) cell->timings[of[q]].repeated[i] = seconds[q];
  }
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
  std::vector<Stream> streams;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    cell->targets.push_back({hwy::TargetName(target), {}});
    Stream stream{[target] { use_targets(target); }, {}};
    for (const Transform& X_AB : cell->configurations)
      stream.queries.emplace_back([solver, &X_AB] { solver->collide(X_AB); });
    streams.push_back(std::move(stream));
  }
  const std::vector<std::vector<double>> seconds = time_streams(streams, options.rounds);
  use_targets(0);
  for (std::size_t i = 0; i < seconds.size(); ++i) cell->targets[i].collide = seconds[i];
}

void time_batches(std::span<const Algorithm> algorithms, const Solvers& solvers, const MeasureOptions& options,
                  ContactConfigurations& make, Cell* cell) {
  const std::size_t count = cell->configurations.size(), wanted = static_cast<std::size_t>(options.batches);
  std::vector<std::array<Transform, 16>> batches;
  // Spread over the cell, so that both methods and both sides of a contact have their share.
  for (std::size_t i = 0; i < wanted; ++i)
    batches.push_back(make.near(cell->configurations[i * (count - 1) / (wanted - 1)]));
  for (std::size_t k = 0; k < algorithms.size(); ++k) {
    if (!algorithms[k].has_batches) continue;
    PairSolver* solver = solvers[k].get();
    std::array<bool, 16> answers = {};
    std::vector<Stream> streams(2);
    for (const std::array<Transform, 16>& batch : batches) {
      solver->collide_batch(batch, answers);
      for (std::size_t i = 0; i < batch.size(); ++i) PRESCENE_CHECK(answers[i] == solver->collide(batch[i]));
      streams[0].queries.emplace_back([solver, &batch, &answers] { solver->collide_batch(batch, answers); });
      streams[1].queries.emplace_back([solver, &batch] {
        for (const Transform& X_AB : batch) solver->collide(X_AB);
      });
    }
    const std::vector<std::vector<double>> seconds = time_streams(streams, options.rounds);
    cell->timings[k].batch = seconds[0];
    cell->timings[k].batch_single = seconds[1];
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

std::vector<std::vector<double>> time_streams(std::span<const Stream> streams, int rounds, bool cold) {
  std::vector<std::uint64_t> other_things(cold ? kOtherThings / sizeof(std::uint64_t) : 0, 1);
  const std::function<void()> nothing = [] {};
  std::vector<double> clock;
  for (int i = 0; i < 101; ++i) clock.push_back(time_block(nothing, 1));
  const double clock_takes = median(std::move(clock));
  std::vector<std::vector<double>> best;
  for (const Stream& stream : streams)
    best.emplace_back(stream.queries.size(), std::numeric_limits<double>::infinity());
  for (std::size_t round = 0; round < static_cast<std::size_t>(rounds); ++round) {
    for (std::size_t turn = 0; turn < streams.size(); ++turn) {
      const std::size_t s = (turn + round) % streams.size();
      streams[s].before();
      if (!cold)
        for (const std::function<void()>& query : streams[s].queries) query();
      for (std::size_t q = 0; q < streams[s].queries.size(); ++q) {
        for (std::uint64_t& thing : other_things) ++thing;
        best[s][q] = std::min(best[s][q], std::max(1e-9, time_block(streams[s].queries[q], 1) - clock_takes));
      }
    }
  }
  return best;
}

std::vector<double> time_repeated(std::span<const std::function<void()>> queries, const MeasureOptions& options) {
  std::vector<int> repeats;
  for (const std::function<void()>& query : queries) {
    query();
    const double once = std::max(time_block(query, 1), 1e-9);
    repeats.push_back(std::clamp(static_cast<int>(std::ceil(options.block / once)), 1, 1000));
  }
  std::vector<double> best(queries.size(), std::numeric_limits<double>::infinity());
  for (std::size_t round = 0; round < static_cast<std::size_t>(options.rounds); ++round) {
    for (std::size_t turn = 0; turn < queries.size(); ++turn) {
      const std::size_t q = (turn + round) % queries.size();
      queries[q]();
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
    decide_distances(pair, algorithms, &cell, measurements);
    time_booleans(algorithms, solvers, options, &cell);
    if (!options.cold) {
      time_distances(algorithms, solvers, options, &cell);
      time_again_and_again(algorithms, solvers, options, &cell);
      time_targets(algorithms, solvers, options, &cell);
      time_batches(algorithms, solvers, options, make, &cell);
    }
    measurements->cells.push_back(std::move(cell));
  }
}

}  // namespace prescene::benchmarks
