// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>

#include "benchmarks/collision_algorithms.h"
#include "benchmarks/collision_tables.h"
#include "benchmarks/collision_targets.h"
#include "prescene/collision/dops/boxtree.h"
#include "prescene/collision/dops/bvhlite_tree.h"
#include "prescene/collision/dops/simdop_tree.h"
#include "tests/support/collision_meshes.h"

namespace prescene::benchmarks {
namespace {

using collision::Boxtree;
using collision::BvhLiteTree;
using collision::PlainBoxtree;
using collision::PlanePrecision;
using collision::SimdopOptions;
using collision::SimdopTree;

// Small meshes have partly filled nodes: memory is told for those that need it.
constexpr std::uint32_t kLeastTriangles = 10000;
// 46 planes of 32 bits and what else the seed's node holds.
constexpr double kPlainNodeBits = 1600.0;

Target memory_target(std::string work, std::optional<double> must, std::optional<double> aim,
                     std::optional<double> reached, std::string unit, std::string baseline) {
  Target target;
  target.work = std::move(work);
  target.better = Better::kLower;
  if (must) target.must = at_most(*must);
  if (aim) target.aim = at_most(*aim);
  target.reached = reached;
  target.unit = std::move(unit);
  target.n = 1;
  target.baseline = std::move(baseline);
  return target;
}

void add_default_tree(const Measurements& measurements, Report* report) {
  Target target = memory_target("default tree, nodes and triangle references", 24.0, 16.0,
                                bytes_a_triangle(measurements, kDefaultTree, kLeastTriangles), "bytes a triangle",
                                "all measured meshes of 10,000 triangles and more");
  target.n = std::count_if(measurements.costs.begin(), measurements.costs.end(), [](const MeshCost& cost) {
    return cost.algorithm == kDefaultTree && cost.triangles >= kLeastTriangles;
  });
  if (!target.reached) target.why = "no such mesh was measured";
  report->add(std::move(target));
}

void add_half_floats(const CollisionMesh& mesh, Report* report) {
  core::ThreadPool pool(1);
  const SimdopTree half = SimdopTree::build(mesh, {.precision = PlanePrecision::kHalf}, pool);
  const SimdopTree single = SimdopTree::build(mesh, {.precision = PlanePrecision::kSingle}, pool);
  const auto percent = [](std::size_t of, std::size_t all) {
    return 100.0 * static_cast<double>(of) / static_cast<double>(all);
  };
  report->add(memory_target("half-float nodes vs 32 bit: memory", 50.0, std::nullopt,
                            percent(half.plane_bytes(), single.plane_bytes()), "%",
                            "planes of " + simdop_name({.precision = PlanePrecision::kSingle})));
  report->add(memory_target("half-float tree vs 32 bit: memory with references", std::nullopt, std::nullopt,
                            percent(half.bytes(), single.bytes()), "%",
                            "all of " + simdop_name({.precision = PlanePrecision::kSingle})));
}

void add_bvhlite(const CollisionMesh& mesh, Report* report) {
  core::ThreadPool pool(1);
  const BvhLiteTree plain = BvhLiteTree::build(mesh, {.bits = 4}, pool);
  // With a node of its own for each triangle, which needs no other reference.
  const double plain_bytes = static_cast<double>(plain.node_count()) * kPlainNodeBits / 8.0;
  for (const auto& [bits, must] : {std::pair(4, 16.0), std::pair(6, 22.0)}) {
    const BvhLiteTree tree = BvhLiteTree::build(mesh, {.bits = bits}, pool);
    report->add(memory_target("BVHLite node, " + std::to_string(bits) + " bit, vs plain node", must, std::nullopt,
                              100.0 * 8.0 * static_cast<double>(tree.stride()) / kPlainNodeBits, "%",
                              "1,600 bits: k = 46, n = 4, 32 bit"));
  }
  for (const int leaf_items : {1, 4, 8}) {
    const BvhLiteTree tree = BvhLiteTree::build(mesh, {.bits = 4, .leaf_items = leaf_items}, pool);
    report->add(memory_target("BVHLite tree, 4 bit, " + std::to_string(leaf_items) + " a leaf, vs plain tree",
                              std::nullopt, 5.31, 100.0 * static_cast<double>(tree.bytes()) / plain_bytes, "%",
                              "nodes of 1,600 bits down to single triangles, " + mesh->name()));
  }
}

void add_boxtree(const CollisionMesh& mesh, Report* report) {
  core::ThreadPool pool(1);
  report->add(memory_target("Boxtree node", 16.0, std::nullopt, sizeof(Boxtree::Node), "bytes", "none"));
  const Boxtree packed = Boxtree::build(mesh, {}, pool);
  const PlainBoxtree plain = PlainBoxtree::build(mesh, collision::BoxtreeOptions{}.builder, pool);
  report->add(memory_target("Boxtree vs plain Boxtree: memory", std::nullopt, std::nullopt,
                            100.0 * static_cast<double>(packed.bytes()) / static_cast<double>(plain.bytes()), "%",
                            "the same tree of heap objects, " + mesh->name() + "; the seed says 18 to 29 %"));
}

}  // namespace

void add_memory_targets(const Measurements& measurements, Report* report) {
  add_default_tree(measurements, report);
  CollisionMesh mesh = tests::read_collision_mesh("scans/stanford_bunny_closed.ply");
  if (mesh == nullptr) mesh = tests::collision_mesh(tests::make_bumpy_sphere(0.1, 60'000), "bumpy_sphere");
  add_half_floats(mesh, report);
  add_bvhlite(mesh, report);
  add_boxtree(mesh, report);
}

}  // namespace prescene::benchmarks
