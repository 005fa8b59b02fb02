// SPDX-License-Identifier: Apache-2.0
// Inner sphere trees: vector instructions against plain C++, and uncertain poses against certain ones.
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "benchmarks/collision_targets.h"
#include "benchmarks/statistics.h"
#include "prescene/collision/spheres/relative_uncertainty.h"
#include "prescene/collision/spheres/scalar_sphere_queries.h"
#include "prescene/collision/spheres/sphere_packing.h"
#include "prescene/collision/spheres/sphere_queries.h"
#include "prescene/collision/spheres/sphere_tree.h"
#include "prescene/collision/spheres/uncertain_sphere_queries.h"
#include "prescene/core/check.h"
#include "tests/support/collision_meshes.h"

namespace prescene::benchmarks {
namespace {

using collision::SpherePacking;
using collision::SphereScratch;
using collision::SphereTree;
using collision::Transform;
using geometry::Pose;

using TreePair = std::array<std::shared_ptr<const SphereTree>, 2>;

struct PackedPair {
  std::string name;
  std::array<std::shared_ptr<const SpherePacking>, 2> packings;
  double size = 0.0;  ///< m
  std::vector<Pose> poses;
};

/// B goes through A from one side to the other while it turns: the two swap places.
std::vector<Pose> swapping(double size, int count) {
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) {
    const double t = (i + 0.5) / count;
    const Eigen::Vector3d along = Eigen::Vector3d(1.0, 0.3, 0.2).normalized();
    poses.push_back({Eigen::Quaterniond(Eigen::AngleAxisd(2.0 * M_PI * t, Eigen::Vector3d(0.2, 1.0, 0.1).normalized())),
                     size * (2.0 * t - 1.0) * along});
  }
  return poses;
}

std::vector<PackedPair> packed_pairs(int spheres, int poses) {
  std::vector<std::array<CollisionMesh, 2>> pairs;
  for (const auto& [a, b] : {std::pair("scans/stanford_dragon.ply", "scans/stanford_dragon.ply"),
                             std::pair("scans/armadillo.ply", "scans/happy_buddha_closed.ply")}) {
    const CollisionMesh mesh_a = tests::read_collision_mesh(a), mesh_b = tests::read_collision_mesh(b);
    if (mesh_a != nullptr && mesh_b != nullptr) pairs.push_back({mesh_a, mesh_b});
  }
  if (pairs.empty()) {
    pairs.push_back({tests::collision_mesh(tests::make_bumpy_sphere(0.1, 20'000), "bumpy_sphere"),
                     tests::collision_mesh(tests::make_knot(0.1, 20'000), "knot")});
  }
  core::ThreadPool pool(1);
  std::vector<PackedPair> packed;
  for (const std::array<CollisionMesh, 2>& pair : pairs) {
    PackedPair made;
    made.name = pair[0]->name() + " / " + pair[1]->name();
    made.size = static_cast<double>(std::min(pair[0]->size(), pair[1]->size()));
    made.poses = swapping(made.size, poses);
    for (std::size_t i = 0; i < 2; ++i) {
      core::Result<collision::PackedMesh> mesh = collision::pack_spheres(*pair[i], {.max_spheres = spheres}, pool);
      PRESCENE_CHECK_MSG(mesh.ok(), mesh.status().message());
      made.packings[i] = mesh->packing;
    }
    packed.push_back(std::move(made));
  }
  return packed;
}

TreePair trees_of(const PackedPair& pair, int branching) {
  core::ThreadPool pool(1);
  TreePair trees;
  for (std::size_t i = 0; i < 2; ++i) {
    core::Result<std::shared_ptr<const SphereTree>> tree =
        SphereTree::make(pair.packings[i], {.branching = branching}, pool);
    PRESCENE_CHECK_MSG(tree.ok(), tree.status().message());
    trees[i] = *std::move(tree);
  }
  return trees;
}

/// Times of the same queries asked in two ways.
struct Compared {
  std::string work;
  std::string slow_name, fast_name;
  std::vector<double> slow, fast;  ///< s

  std::vector<double> ratios() const {
    std::vector<double> each;
    for (std::size_t i = 0; i < slow.size(); ++i) each.push_back(slow[i] / fast[i]);
    return each;
  }
  void measure(const std::vector<std::function<void()>>& slow_queries,
               const std::vector<std::function<void()>>& fast_queries, int rounds) {
    std::vector<Stream> streams(2);
    streams[0].queries = slow_queries;
    streams[1].queries = fast_queries;
    const std::vector<std::vector<double>> seconds = time_streams(streams, rounds);
    slow.insert(slow.end(), seconds[0].begin(), seconds[0].end());
    fast.insert(fast.end(), seconds[1].begin(), seconds[1].end());
  }
};

using Queries = std::vector<std::function<void()>>;

/// Shared volume, boolean and force, for all pairs and poses where the packings touch.
std::array<Compared, 3> scalar_to_vector(const std::vector<PackedPair>& pairs, int branching, int rounds) {
  const std::string n = ", branching " + std::to_string(branching);
  std::array<Compared, 3> compared = {{{"overlap volume" + n, "scalar", "SIMD", {}, {}},
                                       {"boolean" + n, "scalar", "SIMD", {}, {}},
                                       {"force" + n, "scalar", "SIMD", {}, {}}}};
  SphereScratch scratch;
  for (const PackedPair& pair : pairs) {
    const TreePair trees = trees_of(pair, branching);
    const SphereTree &a = *trees[0], &b = *trees[1];
    std::vector<Transform> touching;
    for (const Pose& pose : pair.poses) {
      const Transform X_AB = *collision::to_transform(pose);
      if (collision::overlap(a, b, X_AB, scratch)) touching.push_back(X_AB);
    }
    std::array<Queries, 6> queries;
    for (const Transform& X_AB : touching) {
      queries[0].emplace_back([&] { collision::scalar::overlap_volume(a, b, X_AB, scratch); });
      queries[1].emplace_back([&] { collision::overlap_volume(a, b, X_AB, scratch); });
      queries[2].emplace_back([&] { collision::scalar::overlap(a, b, X_AB, scratch); });
      queries[3].emplace_back([&] { collision::overlap(a, b, X_AB, scratch); });
      queries[4].emplace_back([&] { collision::scalar::penalty_wrench(a, b, X_AB, {}, scratch); });
      queries[5].emplace_back([&] { collision::penalty_wrench(a, b, X_AB, {}, scratch); });
    }
    for (std::size_t i = 0; i < 3; ++i) compared[i].measure(queries[2 * i], queries[2 * i + 1], rounds);
  }
  return compared;
}

/// Each body's pose with standard deviations of `angle` (rad) and `length` (m) in all directions.
collision::RelativeUncertainty uncertain(const Pose& X_AB, double angle, double length) {
  collision::UncertainPose a, b;
  b.X_WB = X_AB;
  Eigen::Matrix<double, 6, 1> deviations;
  deviations << Eigen::Vector3d::Constant(angle), Eigen::Vector3d::Constant(length);
  a.covariance = b.covariance = deviations.cwiseAbs2().asDiagonal();
  const core::Result<collision::RelativeUncertainty> between = collision::RelativeUncertainty::make(a, b);
  PRESCENE_CHECK_MSG(between.ok(), between.status().message());
  return *between;
}

/// State and overlap against certain overlaps, and force; deviations of `share` of the size and 2 degrees a percent.
/// The same follow for the poses alone whose means don't overlap, where no plain query can stop early.
std::array<Compared, 8> uncertain_to_certain(const std::vector<PackedPair>& pairs, double share, int rounds) {
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), ", deviations %.2g degrees and %.2g %% of the size", 200.0 * share,
                100.0 * share);
  const std::string deviations = text.data();
  std::array<Compared, 8> compared;
  for (std::size_t i = 0; i < compared.size(); ++i) {
    const std::string where = i < 4 ? deviations : ", apart" + deviations;
    compared[i].slow_name =
        std::array{"uncertain state", "uncertain overlap", "uncertain overlap", "uncertain wrench"}[i % 4];
    compared[i].fast_name = std::array{"boolean", "boolean", "overlap volume", "penalty wrench"}[i % 4];
    compared[i].work = compared[i].slow_name + " vs " + compared[i].fast_name + where;
  }
  SphereScratch scratch;
  collision::UncertainScratch uncertain_scratch;
  for (const PackedPair& pair : pairs) {
    const TreePair trees = trees_of(pair, 16);
    const SphereTree &a = *trees[0], &b = *trees[1];
    std::vector<collision::RelativeUncertainty> between;
    for (const Pose& X_AB : pair.poses)
      between.push_back(uncertain(X_AB, 200.0 * share * M_PI / 180.0, share * pair.size));
    for (const bool apart : {false, true}) {
      Queries state, overlap, boolean, volume, wrench, force;
      for (const collision::RelativeUncertainty& one : between) {
        if (apart && collision::overlap(a, b, one.X_AB(), scratch)) continue;
        state.emplace_back([&] { collision::overlap_state(a, b, one, uncertain_scratch); });
        overlap.emplace_back([&] { collision::uncertain_overlap(a, b, one, uncertain_scratch); });
        boolean.emplace_back([&] { collision::overlap(a, b, one.X_AB(), scratch); });
        volume.emplace_back([&] { collision::overlap_volume(a, b, one.X_AB(), scratch); });
        wrench.emplace_back([&] { collision::uncertain_wrench(a, b, one, {}, uncertain_scratch); });
        force.emplace_back([&] { collision::penalty_wrench(a, b, one.X_AB(), {}, scratch); });
      }
      const std::size_t first = apart ? 4 : 0;
      compared[first].measure(state, boolean, rounds);
      compared[first + 1].measure(overlap, boolean, rounds);
      compared[first + 2].measure(overlap, volume, rounds);
      compared[first + 3].measure(wrench, force, rounds);
    }
  }
  return compared;
}

Target sphere_target(const Compared& compared, std::optional<double> must, std::optional<double> aim, Better better,
                     const std::string& where) {
  Target target;
  target.work = "spheres, " + compared.work;
  target.better = better;
  const auto goal = [&](double value) { return better == Better::kHigher ? at_least(value) : at_most(value); };
  if (must) target.must = goal(*must);
  if (aim) target.aim = goal(*aim);
  target.reached = geometric_mean(compared.ratios());
  target.unit = "x";
  target.n = static_cast<std::int64_t>(compared.slow.size());
  target.baseline = compared.slow_name + " / " + compared.fast_name + where;
  return target;
}

std::vector<Figure> row_of(const Compared& compared) {
  const Summary slow = summarize(compared.slow), fast = summarize(compared.fast);
  return {compared.work,      compared.slow_name, 1e6 * slow.median, 1e6 * slow.mean,
          compared.fast_name, 1e6 * fast.median,  1e6 * fast.mean,   static_cast<std::int64_t>(slow.n)};
}

}  // namespace

void add_sphere_targets(bool quick, Report* report) {
  const int rounds = quick ? 3 : 7;
  const std::vector<PackedPair> pairs = packed_pairs(quick ? 1000 : 5000, quick ? 16 : 64);
  std::string where = ", swapping places";
  for (const PackedPair& pair : pairs) where += ", " + pair.name;
  Table table{"spheres", {"query", "slow", "median_us", "mean_us", "fast", "fast_median_us", "fast_mean_us", "n"}, {}};
  for (const auto& [branching, must, aim] : {std::tuple(4, std::optional(2.0), std::optional(4.0)),
                                             std::tuple(8, std::optional<double>(), std::optional<double>()),
                                             std::tuple(16, std::optional(3.0), std::optional(6.0))}) {
    const std::array<Compared, 3> compared = scalar_to_vector(pairs, branching, rounds);
    for (std::size_t i = 0; i < compared.size(); ++i) {
      // What was asked for is the query that meets all pairs that overlap.
      report->add(sphere_target(compared[i], i == 0 ? must : std::nullopt, i == 0 ? aim : std::nullopt, Better::kHigher,
                                where));
      table.rows.push_back(row_of(compared[i]));
    }
  }
  for (const double share : {0.001, 0.01}) {
    const std::array<Compared, 8> all = uncertain_to_certain(pairs, share, rounds);
    for (const Compared& compared : all) {
      // Against the queries that ask the same, over all poses; the others are told beside them.
      const bool same = compared.fast_name != "overlap volume" && &compared < &all[4];
      report->add(sphere_target(compared, same ? std::optional(2.0) : std::nullopt,
                                same ? std::optional(1.3) : std::nullopt, Better::kLower, where));
      table.rows.push_back(row_of(compared));
    }
  }
  report->add(std::move(table));
}

}  // namespace prescene::benchmarks
