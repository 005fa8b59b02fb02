// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/heat_map_measure.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "prescene/core/check.h"
#include "prescene/queries/final_poses.h"

namespace prescene::benchmarks {
namespace {

constexpr int kHistogram = 1000;
constexpr int kFewest = 16;

/// Mass of each cell that holds any, by its place in the world's lattice.
using CellMasses = std::map<std::pair<int, int>, double>;

CellMasses histogram(const std::vector<belief::Pose>& places, double cell) {
  CellMasses masses;
  for (const belief::Pose& place : places) {
    const auto at = [&](int axis) { return static_cast<int>(std::floor(place.translation[axis] / cell)); };
    masses[{at(0), at(1)}] += 1.0 / static_cast<double>(places.size());
  }
  return masses;
}

CellMasses cells_of(const belief::HeatMap& map) {
  const auto first = [&](double origin) { return static_cast<int>(std::lround(origin / map.cell)); };
  CellMasses masses;
  for (int iy = 0; iy < map.ny; ++iy)
    for (int ix = 0; ix < map.nx; ++ix) {
      const double mass =
          map.mass[static_cast<std::size_t>(iy) * static_cast<std::size_t>(map.nx) + static_cast<std::size_t>(ix)];
      if (mass > 0.0) masses[{first(map.x0) + ix, first(map.y0) + iy}] = mass;
    }
  return masses;
}

double total_variation(const CellMasses& a, const CellMasses& b) {
  double sum = 0.0;
  for (const auto& [cell, mass] : a) {
    const auto other = b.find(cell);
    sum += std::abs(mass - (other == b.end() ? 0.0 : other->second));
  }
  for (const auto& [cell, mass] : b)
    if (!a.contains(cell)) sum += mass;
  return 0.5 * sum;
}

std::size_t judged_object(const UncertainProblem& problem) {
  const std::optional<int> index = belief::find_object(*problem.scene, problem.variables[0].outcomes.at(0).object);
  PRESCENE_CHECK(index);
  return static_cast<std::size_t>(*index);
}

/// Where a net of instances, run to rest, leaves the object.
std::vector<queries::FinalSample> net(const UncertainProblem& problem, std::size_t object, int count,
                                      std::uint64_t seed) {
  core::ThreadPool pool(1);
  simulation::EstimatorOptions options;
  options.exact_instances = count;
  const simulation::OutcomeEstimate estimate =
      simulation::estimate_outcomes(*problem.simulator, problem.starts, problem.variables, problem.request,
                                    core::RandomStream(seed, core::Purpose::kEvaluation), options, pool);
  std::vector<queries::FinalSample> samples;
  for (const simulation::InstanceRecord& record : estimate.instances)
    samples.push_back({record.final.objects[object].X_WO, record.weight, record.classes[0]});
  return samples;
}

std::vector<belief::Pose> places_of(const std::vector<queries::FinalSample>& samples) {
  std::vector<belief::Pose> places;
  for (const queries::FinalSample& sample : samples) places.push_back(sample.X_WO);
  return places;
}

/// Independent instances in the baseline's simulator.
std::vector<belief::Pose> independent(const UncertainProblem& problem, std::size_t object, int count,
                                      core::RandomStream& stream) {
  const simulation::StartComponent& component = problem.starts.components[0];
  std::vector<double> uniforms(static_cast<std::size_t>(component.dimensions));
  std::vector<belief::WorldState> starts;
  for (int i = 0; i < count; ++i) {
    for (double& u : uniforms) u = stream.uniform();
    starts.push_back(component.draw(uniforms));
  }
  std::vector<belief::Trajectory> runs(starts.size());
  core::ThreadPool pool(1);
  problem.stepper->run(starts, problem.request, core::RandomStream(1, core::Purpose::kAction), 0, pool, runs);
  std::vector<belief::Pose> places;
  for (const belief::Trajectory& run : runs) places.push_back(run.final().objects[object].X_WO);
  return places;
}

}  // namespace

MapQuality map_quality(const UncertainProblem& problem, int truth, int seeds) {
  const queries::DensityOptions options;
  const std::size_t object = judged_object(problem);
  const geometry::SymmetryGroup& symmetry = problem.scene->model_of(problem.scene->objects[object]).symmetry;
  const CellMasses true_masses = histogram(places_of(net(problem, object, truth, 1'000'001)), options.cell);

  MapQuality quality;
  core::RandomStream stream(3, core::Purpose::kStartBelief);
  for (int i = 0; i < seeds; ++i) {
    const CellMasses drawn = histogram(independent(problem, object, kHistogram, stream), options.cell);
    quality.histogram += total_variation(drawn, true_masses) / seeds;
  }

  double count_before = 0.0, variation_before = 0.0;
  for (int count = kFewest; quality.instances == 0.0;
       count = count < 64 ? 2 * count : simulation::next_net_size(count)) {
    double variation = 0.0;
    for (int seed = 0; seed < seeds; ++seed) {
      const auto samples = net(problem, object, count, static_cast<std::uint64_t>(seed));
      const auto kernels = queries::kernels(samples, problem.variables[0].classes, symmetry, options);
      variation += total_variation(cells_of(queries::heat_map(kernels, options)), true_masses) / seeds;
    }
    if (count == kFewest) quality.smallest_net = variation;
    if (variation <= quality.histogram || count >= kHistogram) {
      quality.instances = count;
      if (count > kFewest && variation <= quality.histogram) {
        const double part = std::log(variation_before / quality.histogram) / std::log(variation_before / variation);
        quality.instances = count_before * std::pow(count / count_before, part);
      }
    }
    count_before = count;
    variation_before = variation;
  }
  return quality;
}

}  // namespace prescene::benchmarks
