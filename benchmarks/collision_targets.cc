// SPDX-License-Identifier: Apache-2.0
#include "benchmarks/collision_targets.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "benchmarks/collision_algorithms.h"
#include "benchmarks/collision_tables.h"
#include "benchmarks/statistics.h"
#include "prescene/collision/triangle_tree.h"
#include "tests/support/collision_meshes.h"

namespace prescene::benchmarks {
namespace {

using collision::Builder;

constexpr std::array<double, 3> kNearShares = {0.0, 0.01, 0.05};
constexpr std::array<double, 2> kDistanceShares = {0.0, 0.01};
void set_reached(const std::optional<Ratio>& ratio, Target* target) {
  if (!ratio) {
    target->why = "not measured in this run";
    return;
  }
  target->reached = ratio->value;
  target->n = ratio->n;
  target->baseline += ", geometric mean over " + std::to_string(ratio->pairs) + " pairs";
}

Target ratio_target(std::string work, std::optional<double> must, std::optional<double> aim, std::string baseline,
                    const std::optional<Ratio>& ratio) {
  Target target;
  target.work = std::move(work);
  if (must) target.must = at_least(*must);
  if (aim) target.aim = at_least(*aim);
  target.unit = "x";
  target.baseline = std::move(baseline);
  set_reached(ratio, &target);
  return target;
}

}  // namespace

void add_build_targets(Report* report) {
  const std::shared_ptr<const collision::Mesh> mesh =
      tests::collision_mesh(tests::make_bumpy_sphere(0.1, 200'000), "bumpy_sphere_200k");
  core::ThreadPool two(2);
  std::vector<double> seconds;
  for (int i = 0; i < 5; ++i) {
    const auto start = std::chrono::steady_clock::now();
    collision::TriangleTree::build(mesh, {}, two);
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  Target target;
  target.work = "build, default tree, 200k triangles, 2 threads";
  target.better = Better::kLower;
  target.must = at_most(0.3);
  target.aim = at_most(0.1);
  target.reached = median(seconds);
  target.unit = "s";
  target.n = static_cast<std::int64_t>(seconds.size());
  target.baseline = "none: median of the builds of a bumpy sphere";
  report->add(target);
}

void add_query_targets(const Measurements& measurements, Report* report) {
  const auto boolean = [&](std::string_view baseline) {
    return speed_ratio(measurements, kDefaultTree, baseline, Query::kCollide, kNearShares);
  };
  const std::string near = " at 0, 1 % and 5 %";
  report->add(
      ratio_target("boolean vs FCL", 20.0, 40.0, "FCL, OBBRSS, double precision, one contact" + near, boolean(kFcl)));
  report->add(ratio_target("boolean vs Bullet GImpact", 25.0, 60.0,
                           "GImpact, no margin, first contact, one-sided triangles" + near, boolean(kGimpact)));
  report->add(ratio_target("boolean vs scalar binary k-DOP tree", 10.0, 20.0, "ours, k = 32, longest axis" + near,
                           boolean(kScalarDops)));
  report->add(ratio_target("boolean vs FCL, the same query again and again", std::nullopt, std::nullopt,
                           "FCL, OBBRSS" + near,
                           speed_ratio(measurements, kDefaultTree, kFcl, Query::kCollideRepeated, kNearShares)));
  report->add(ratio_target("boolean vs ODE", std::nullopt, std::nullopt, "ODE's trimesh" + near, boolean(kOde)));
  report->add(
      ratio_target("boolean vs Embree", std::nullopt, std::nullopt, "rtcCollide with refit" + near, boolean(kEmbree)));
  report->add(ratio_target("boolean, batch of 16 near vs singles", 2.0, 3.0, "the same 16 one by one" + near,
                           batch_ratio(measurements, kDefaultTree, kNearShares)));
  report->add(ratio_target("exact distance vs FCL", 15.0, 30.0, "FCL, OBBRSS, at 0 and 1 %",
                           speed_ratio(measurements, kDefaultTree, kFcl, Query::kDistance, kDistanceShares)));
}

void add_cold_targets(const Measurements& cold, Report* report) {
  const auto boolean = [&](std::string_view baseline) {
    return speed_ratio(cold, kDefaultTree, baseline, Query::kCollide, kNearShares);
  };
  const std::string near = ", two meshes of a million triangles, at 0, 1 % and 5 %";
  report->add(
      ratio_target("cold caches: boolean vs FCL", std::nullopt, std::nullopt, "FCL, OBBRSS" + near, boolean(kFcl)));
  report->add(ratio_target("cold caches: boolean vs scalar binary k-DOP tree", std::nullopt, std::nullopt,
                           "ours, k = 32, longest axis" + near, boolean(kScalarDops)));
}

void add_study_targets(const Measurements& study, Report* report) {
  const collision::SimdopOptions half{.precision = collision::PlanePrecision::kHalf};
  const collision::SimdopOptions single{.precision = collision::PlanePrecision::kSingle};
  report->add(ratio_target("half-float nodes vs 32 bit: time", 1.0, 1.0 / 0.9,
                           simdop_name(single) + ", at 0, 1 % and 5 %",
                           speed_ratio(study, simdop_name(half), simdop_name(single), Query::kCollide, kNearShares)));
  report->add(ratio_target("Boxtree of 16-byte nodes vs plain Boxtree", std::nullopt, std::nullopt,
                           "the same tree of heap objects, at 0, 1 % and 5 %; the seed says 0.9",
                           speed_ratio(study, kBoxtree, kPlainBoxtree, Query::kCollide, kNearShares)));
  for (const bool simdop : {true, false}) {
    const auto name = [simdop](Builder builder) {
      return simdop ? simdop_name({.builder = builder}) : default_tree_name(builder);
    };
    for (const Builder gas : {Builder::kNeuralGas, Builder::kWeightedNeuralGas}) {
      std::optional<Ratio> worst;
      std::string worst_name;
      for (const Builder builder : collision::kAllBuilders) {
        if (builder == Builder::kNeuralGas || builder == Builder::kWeightedNeuralGas) continue;
        const std::optional<Ratio> ratio = speed_ratio(study, name(gas), name(builder), Query::kCollide, kNearShares);
        if (!ratio || (worst && worst->value >= ratio->value)) continue;
        worst = ratio;
        worst_name = collision::to_string(builder);
      }
      const std::string tree = simdop ? "SIMDop" : "default tree";
      report->add(ratio_target(std::string(collision::to_string(gas)) + " vs the worst split, " + tree, std::nullopt,
                               std::nullopt, worst_name + ", at 0, 1 % and 5 %", worst));
      report->add(ratio_target(
          std::string(collision::to_string(gas)) + " vs surface area heuristic, " + tree, std::nullopt, std::nullopt,
          "surface area heuristic, at 0, 1 % and 5 %",
          speed_ratio(study, name(gas), name(Builder::kSurfaceAreaHeuristic), Query::kCollide, kNearShares)));
    }
  }
}

}  // namespace prescene::benchmarks
